#pragma once

#include <stdexcept>

namespace palpate::runner {

/// No window can be opened or no picture drawn: not built in, no display, or an unsuitable one;
/// what() says which.
class DisplayError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace palpate::runner
