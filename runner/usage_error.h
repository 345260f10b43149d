#pragma once
// A fault in what the user asked for, which main.cpp prints with exit status 2.

#include <stdexcept>

namespace palpate::runner {

class UsageError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace palpate::runner
