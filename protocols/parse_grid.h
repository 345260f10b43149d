#pragma once
// Reading of lists of numbers, written out or as a range.

#include <cstddef>
#include <vector>

#include "protocols/object_reader.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

struct GridLimits {
  NumberRange range;
  std::size_t most = 1000;
  Presence presence = Presence::optional;
  bool may_repeat = false;  ///< false: each value once
};

/// A number, a list of numbers, {"from": 1, "to": 10, "count": 19, "spacing": "linear" or "log"},
/// or {"values": [...], "weights": [...]}. Empty and a fault otherwise.
ParameterGrid read_grid(ObjectReader& reader, const char* key, const GridLimits& limits);
/// The same without weights.
std::vector<double> read_grid_values(ObjectReader& reader, const char* key,
                                     const GridLimits& limits);

}  // namespace palpate::protocols
