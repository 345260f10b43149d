#pragma once
// Where two closed surfaces are nearest to each other, and touch or soon will. World frame, m.
// Nothing here allocates once there is room.

#include <vector>

#include "stimuli/surfaces/collision_surface.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The part of space to be searched, m.
struct GapLimits {
  double reach = 0;     ///< places farther apart are left out
  double depth = 1e-3;  ///< corners and edges deeper inside the other surface are left out
};

/// A surface at its present place.
struct SurfacePlace {
  const stimuli::CollisionSurface* surface = nullptr;
  Mat3 axes;      ///< rotation from its frame
  Vec3 position;  ///< of its origin
};

/// A place where the distance is least among places nearby.
struct NearPlace {
  Vec3 place;      ///< half-way between the two
  Vec3 normal;     ///< unit, from a to b
  double gap = 0;  ///< negative: they overlap
};

/// The nearest places of two surfaces, and working memory.
struct NearPlaces {
  static constexpr std::size_t kMost = 4096, kMostChosen = 32;
  std::vector<NearPlace> all, chosen;
  bool dropped = false;  ///< places did not fit and were left out

  void make_room();
};

/// The least gap of corners to faces, edges and corners, and of convex edges to each other, where
/// each is the farthest of its surroundings towards the other (local minima of distance: Johnson &
/// Willemsen 2003, Six degree-of-freedom haptic rendering of complex polygonal models; here with
/// signs, so that overlaps have their depth).
/// \return the least gap; if that is greater than both limits, the greater of these
double gap_between(const SurfacePlace& a, const SurfacePlace& b, const GapLimits& limits);

/// The same with the places within reach, of which `chosen` hold them apart as well as all: with
/// each normal the nearest, and those that touch first in a turn. \param turn  rad, by which they
/// may turn against each other: corners that are the farthest only then are places as well
double find_places(const SurfacePlace& a, const SurfacePlace& b, const GapLimits& limits,
                   double turn, NearPlaces& out);

/// m; the depth of the deepest of these places inside the other surface: corners, pieces of edges,
/// middles of faces and of the solid under them. 0: they do not overlap. Slow.
double overlap_of(const SurfacePlace& a, const SurfacePlace& b);

}  // namespace palpate::rendering
