#pragma once
// The surface at which a stimulus is felt first.

#include <vector>

#include "runner/participants/distance_field.h"
#include "stimuli/shapes.h"

namespace palpate::runner::participants {

/// The convex parts of the outermost surface that has a stiffness, relative to the centre of the
/// workspace. That is the object's surface or, if its stiffness is 0, the uppermost layer with a
/// stiffness. The simulated participant does not know the layers below it.
/// \throws MeshError
std::vector<PlacedPart> felt_parts(const stimuli::ObjectSpec& stimulus);

/// Whether there is such a surface.
bool can_be_felt(const stimuli::ObjectSpec& stimulus);

}  // namespace palpate::runner::participants
