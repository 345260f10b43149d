#pragma once
// Where a stimulus is felt first.

#include <vector>

#include "runner/participants/distance_field.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

/// The convex parts of the outermost surface that has a stiffness, in the frame of the workspace
/// about its centre: the surface itself, or, where its stiffness is 0, the uppermost layer that has
/// one. Layers below it are not known to the simulated participant.
/// \throws MeshError
std::vector<PlacedPart> felt_parts(const stimuli::ObjectSpec& stimulus);

/// Whether there is such a surface.
bool can_be_felt(const stimuli::ObjectSpec& stimulus);

}  // namespace palpate::runner
