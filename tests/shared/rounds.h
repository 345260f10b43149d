#pragma once
// How much a test that draws its cases draws.

#include <cstdlib>
#include <string>

namespace palpate::testing {

/// `usual`, as many as every run has time for, times the environment's PALPATE_ROUNDS if that is
/// set.
inline int rounds(int usual) {
  const char* const asked = std::getenv("PALPATE_ROUNDS");
  return asked == nullptr ? usual : usual * std::stoi(asked);
}

}  // namespace palpate::testing
