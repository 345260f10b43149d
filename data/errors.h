#pragma once

#include <stdexcept>

namespace palpate::data {

/// The database could not be read or written; what() names the file and says what to do.
class StoreError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The file is not ours, or what was asked does not fit what it holds (a number that is taken, a
/// trial that has its record): bad input rather than a failure. Commands exit with 2.
class StoreRefused : public StoreError {
  using StoreError::StoreError;
};

}  // namespace palpate::data
