// Whatever an Inverse Service sends: a version, a list and a state are refused with a reason, or
// what they give can be used: an axis of length one, ids that a command can name.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "runner/devices/haply/inverse3.h"

namespace haply = palpate::runner::devices::haply;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const haply::ServiceVersion version = haply::parse_version(text);
    if (version.major < 3) std::abort();
    haply::dialect_of(version);
  } catch (const std::runtime_error&) {
  }
  const auto scale = haply::parse_force_scale(text);
  if (scale && !std::isfinite(*scale)) std::abort();
  std::string arm = "049D", grip = "G1";
  try {
    const haply::Inventory found = haply::parse_inventory(text);
    for (const haply::Listed& one : found.arms) {
      if (one.id.empty()) std::abort();
      arm = one.id;
      try {
        const std::string said = haply::command(one.id, {1, -2, 3}, haply::Dialect::vector, true);
        if (!nlohmann::json::parse(said).is_object()) std::abort();
        const std::string set = haply::configuration(one.id, haply::PresetForm::object);
        if (!nlohmann::json::parse(set).is_object()) std::abort();
      } catch (const std::runtime_error&) {  // so long a name
      }
    }
    if (!found.grips.empty()) grip = found.grips[0].id;
  } catch (const std::runtime_error&) {
  }
  try {
    const haply::State state = haply::parse_state(text, arm, grip);
    if (!(std::abs(glm::length(state.axis) - 1) < 1e-9)) std::abort();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
