// Whatever a pattern says: its fault is within it, or it holds, does not, or is undefined.

#include "analysis/statistics/pattern.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using palpate::analysis::Pattern, palpate::analysis::PatternError;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto resolve = [](const std::string& name) -> std::optional<std::size_t> {
    if (name == "cone") return 0;
    if (name == "cube") return 1;
    return std::nullopt;
  };
  try {
    const Pattern pattern(text, resolve, {"cone", "cube"});
    const std::array<double, 3> values{-1.5, 40, NAN};
    for (const double cone : values) {
      for (const double cube : values)
        pattern.holds([&](std::size_t column) { return column == 0 ? cone : cube; });
    }
  } catch (const PatternError& error) {
    if (error.place() > text.size() || *error.what() == '\0') std::abort();
  }
  return 0;
}
