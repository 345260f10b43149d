#pragma once
// When an object lets go of the tool: the trial began inside it, the tool is hooked, or a layer
// breaks. Forces fade; they do not step. World frame, SI units.

#include <cstdint>

#include "rendering/union_contact.h"

namespace palpate::rendering {

/// s; a released force takes this long to fall to zero: from 6 N, 0.3 N a tick at 1 kHz, less than
/// the force limiter allows.
inline constexpr double kFadeTime = 0.02;

/// Call before the ideal tools are followed. Switches off objects that contain the virtual tool at
/// the very first tick, and switches objects back on that have been left.
void update_objects(UnionTick& tick);

/// Whether the group gives no force now, or never does because it only bounds its object.
bool is_off(const UnionTick& tick, const PartGroup& group);

/// Call after material forces. Reduces the contact forces of hooked objects and broken layers.
void fade_forces(UnionTick& tick);

}  // namespace palpate::rendering
