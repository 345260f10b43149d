#pragma once
// Errors of data/: messages for the user that name the file and what to do.

#include <stdexcept>

namespace palpate::data {

/// A file could not be read or written. Commands exit with 1.
class StoreError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Bad input: not a palpate database, a damaged one, or a request that conflicts with its content
/// (a number that is taken, a trial that has a record). Commands exit with 2.
class StoreRefused : public StoreError {
  using StoreError::StoreError;
};

}  // namespace palpate::data
