#pragma once
// The effects that a protocol names as its tests: the family of the adjusted p values.

#include "protocols/object_reader.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads `tests`: "group", "renderer", factors, "shape" and their products, "group:surface", in
/// this order. \pre renderers, blocks, factors and groups have been read
void read_tested_effects(ObjectReader& reader, Protocol& protocol);

}  // namespace palpate::protocols
