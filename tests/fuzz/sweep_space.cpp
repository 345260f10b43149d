// Whatever a space of settings holds: every fault is named, or it gives a value for every share.

#include "protocols/sweep_space.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "protocols/parse.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::protocols;
  try {
    const SweepSpace space =
        parse_sweep_space_text(std::string(reinterpret_cast<const char*>(data), size), "s.json");
    if (space.parameters.empty()) std::abort();
    for (const SweepParameter& one : space.parameters) {
      if (one.paths.empty()) std::abort();
      for (const double share : {0.0, 1e-9, 0.5, 1 - 1e-9, 1.0}) {
        const nlohmann::json value = one.value_at(share);
        if (value.is_structured() || value.is_null()) std::abort();
        if (!value.is_number() || one.distribution == DistributionKind::choice) continue;
        const double number = value.get<double>();
        if (!(number >= one.low && number <= one.high)) std::abort();
      }
    }
  } catch (const InputError& error) {
    if (error.faults().empty()) std::abort();
  }
  return 0;
}
