#pragma once
// Reading of what the stylus carries and how far it reaches, for scenes and protocols.

#include <optional>

#include "protocols/object_reader.h"
#include "protocols/scene_spec.h"

namespace palpate::protocols {

/// Reads the keys `tool` and `reach` of a scene or protocol.
void read_tool(ObjectReader& reader, ToolSpec& tool);
/// Faults a radius that nothing asks for. \param soft  whether some object gives
void check_radius(ObjectReader& reader, const ToolSpec& tool, bool soft);
void read_reach(ObjectReader& reader, std::optional<ReachSpec>& reach);

}  // namespace palpate::protocols
