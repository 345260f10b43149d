#pragma once
// Mass, centre and inertia of solids from their surfaces, exactly (divergence theorem).

#include <span>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// Integrals over a solid, of places from a point near it: squares of a far origin's distance would
/// eat the digits.
struct VolumeMoments {
  Vec3 about;             ///< m; that point
  double volume = 0;      ///< m^3
  Vec3 first;             ///< m^4; integral of the place
  Mat3 second = Mat3(0);  ///< m^5; integral of place times place transposed
};

/// A convex part where it stands in its object.
struct PlacedMesh {
  const stimuli::ConvexMesh* mesh = nullptr;
  Pose pose;
};

/// Of the union of convex parts: what several of them cover counts once. Parts may abut.
VolumeMoments moments_of_union(std::span<const PlacedMesh> parts);

/// Of a solid of one density throughout, in the frame of its moments.
struct MassProperties {
  double mass = 0;  ///< kg
  Vec3 centre;      ///< m
  Mat3 inertia;     ///< kg m^2, about the centre
};

MassProperties with_density(const VolumeMoments& moments, double density);  ///< kg/m^3
MassProperties with_mass(const VolumeMoments& moments, double mass);        ///< kg

}  // namespace palpate::rendering
