#pragma once
// On which side of a line a point lies, in x and y, exactly.

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Sign of (b - a) x (q - a) in x and y with q moved by an infinitesimal (e, e^2): never 0 unless a
/// and b coincide. Exact, so neighbours agree on the side that they share.
int side_of(const Vec3& a, const Vec3& b, const Vec3& q);

}  // namespace palpate::stimuli
