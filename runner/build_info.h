#pragma once

#include <string>

namespace palpate::runner {

/// Compiler and build type for the record: "g++ 12.2.0, Release".
inline std::string build_description() {
#if defined(__clang__)
  const std::string compiler = "clang " __clang_version__;
#else
  const std::string compiler = "g++ " __VERSION__;
#endif
  return compiler + ", " PALPATE_BUILD;
}

}  // namespace palpate::runner
