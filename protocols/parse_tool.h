#pragma once
// Reading of the tool, its reach and gravity, for scenes and protocols.

#include <optional>

#include "protocols/object_reader.h"
#include "protocols/scene_spec.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

/// Reads the keys `tool` and `reach` of a scene or protocol.
void read_tool(ObjectReader& reader, ToolSpec& tool);
/// Faults a radius that nothing needs. \param soft whether an object is soft
void check_radius(ObjectReader& reader, const ToolSpec& tool, bool soft);
void read_reach(ObjectReader& reader, std::optional<ReachSpec>& reach);

/// Reads gravity_m_per_s2.
void read_gravity(ObjectReader& reader, Vec3& gravity);

}  // namespace palpate::protocols
