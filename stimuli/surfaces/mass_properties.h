#pragma once
// Volume, mass, centre and inertia of solids of uniform density. SI units.

#include <span>

#include "stimuli/surfaces/surface.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

class ConvexMesh;

/// Integrals over a solid from its surface, exactly (divergence theorem), of places relative to a
/// point near it: squares of the distance to a far origin would lose digits.
struct VolumeMoments {
  Vec3 about;             ///< m; that point
  double volume = 0;      ///< m^3
  Vec3 first;             ///< m^4; integral of the place
  Mat3 second = Mat3(0);  ///< m^5; integral of place times place transposed
};

/// A convex part at its place in its object.
struct PlacedMesh {
  const ConvexMesh* mesh = nullptr;
  Pose pose;
};

/// Of the union of convex parts: regions that several of them cover count once. Parts may abut.
VolumeMoments moments_of_union(std::span<const PlacedMesh> parts);

/// Of the solid inside a closed surface. If its shells overlap, the overlap counts once: then
/// computed from crossings along 160,000 lines, to some 1e-4.
VolumeMoments moments_of_surface(const Surface& surface, const Pose& pose);

/// For a solid of uniform density, in the frame of its moments.
struct MassProperties {
  double mass = 0;  ///< kg
  Vec3 centre;      ///< m
  Mat3 inertia;     ///< kg m^2, about the centre
};

MassProperties with_density(const VolumeMoments& moments, double density);  ///< kg/m^3
MassProperties with_mass(const VolumeMoments& moments, double mass);        ///< kg

}  // namespace palpate::stimuli
