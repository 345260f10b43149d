#pragma once
// When an object lets go of the tool: one that the trial began inside of, a hook that the tool can
// not turn out of, a layer that breaks. Forces fade, they do not step. World frame, SI units.

#include <cstdint>

#include "rendering/union_contact.h"

namespace palpate::rendering {

/// s; a force that is let go of takes this long to fall to zero: 0.3 N a tick at 1 kHz from 6 N,
/// less than the limiter lets pass.
inline constexpr double kFadeTime = 0.02;

/// Before the ideal tools are followed: objects that the virtual tool is inside of at the first
/// tick of all go off; those that are off and have been left come back.
void update_objects(UnionTick& tick);

/// Whether the group gives no force for now, or never: it only bounds its object.
bool is_off(const UnionTick& tick, const PartGroup& group);

/// After materials have had their say: hooked objects and broken layers lose their force. Changes
/// the contacts' forces.
void fade_forces(UnionTick& tick);

}  // namespace palpate::rendering
