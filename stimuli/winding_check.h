#pragma once
// Checks that a closed surface winds round no place a negative number of times.

#include <functional>
#include <string>

#include "stimuli/closed_surface.h"

namespace palpate::stimuli {

/// \param tolerance  m; places that are not farther than this from the surface do not count
/// \param name  of a triangle, for messages
/// \throws MeshError: a shell is turned inside out and in no other, the surface passes through
/// itself so that it winds round a place a negative number of times, there is no volume
void check_winding(const ClosedSurface& surface, double tolerance,
                   const std::function<std::string(std::uint32_t triangle)>& name);

}  // namespace palpate::stimuli
