#pragma once
// Distinguishable orientations of a stimulus.

#include <vector>

#include "runner/participants/distance_field.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

/// Point i of n of a super-Fibonacci spiral, evenly spread over all rotations (Alexa 2022,
/// "Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of SO(3)", algorithm 1).
Quat super_fibonacci(int i, int n);

/// The rotations about the origin that map a solid to itself, the identity first: its field then
/// changes by at most a fifth of its spacing (root mean square, near the surface). An axis of
/// symmetry runs through a corner, or the middle of an edge or a facet, of the convex hull; turns
/// by 360 degrees over 2 to 32 are tried about each.
std::vector<Quat> symmetries(const std::vector<PlacedPart>& parts, const DistanceField& field);

/// Rotations some 11 to 14 degrees apart: of each set that is equivalent by symmetry, the smallest.
std::vector<Mat3> distinct_rotations(const std::vector<Quat>& group);

}  // namespace palpate::runner::participants
