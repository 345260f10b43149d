#pragma once
// The distance of two convex parts and the places where they touch. World frame, m. Nothing here
// allocates.

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "rendering/first_contact.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::rendering {

/// A convex part at its present place.
struct ConvexPlace {
  const stimuli::ConvexMesh* mesh = nullptr;
  Mat3 axes;      ///< rotation from the mesh frame
  Vec3 position;  ///< of the mesh frame's origin
  Vec3 inside;    ///< a point inside, mesh frame

  Vec3 world_point(const Vec3& local) const { return axes * local + position; }
  /// A direction in the mesh frame.
  Vec3 local_vector(const Vec3& world) const { return world * axes; }
};

/// The state of a pair of parts between ticks.
struct GapMemory {
  Vec3 normal;  ///< of the last gap, zero at first
  std::uint32_t support_a = 0, support_b = 0;
  std::array<std::array<std::uint32_t, 2>, 3> nearest{};  ///< vertices of the last simplex
  std::uint32_t nearest_count = 0;
  double least = -HUGE_VAL;  ///< m; they were at least this far apart at PairPlaces
};

/// A slab between two parts.
struct Gap {
  Vec3 normal;          ///< unit, from a to b
  double distance = 0;  ///< between the planes that touch a and b; negative: overlap
  Vec3 on_a, on_b;      ///< the nearest points, if closer than `enough`
};

/// The slab of largest distance. Gilbert, Johnson & Keerthi 1988, with both parts shrunk by 1e-4
/// about a point inside: touching parts are then well apart, and shrinking keeps the normals of
/// faces and edges. Parts that overlap more than that are shrunk further.
/// \param enough  stop at a slab of this distance
Gap gap_between(const ConvexPlace& a, const ConvexPlace& b, double enough, GapMemory& memory);

/// One place where two parts touch or nearly do.
struct ManifoldPoint {
  Vec3 place;      ///< half-way between the two
  double gap = 0;  ///< negative: they overlap
};

/// The contact region of two parts: a face and the piece of the other part over it, or one point.
class Manifold {
 public:
  static constexpr std::size_t kMostPoints = 8;
  Vec3 normal;  ///< unit, from a to b
  std::span<const ManifoldPoint> points() const { return {points_.data(), count_}; }
  void clear() { count_ = 0; }
  void add(const ManifoldPoint& point) {
    if (count_ < kMostPoints) points_[count_++] = point;
  }

 private:
  std::array<ManifoldPoint, kMostPoints> points_;
  std::size_t count_ = 0;
};

/// Working memory for clipped polygons.
struct ClipRoom {
  std::vector<Vec3> polygon, next;
  std::vector<ManifoldPoint> points;
};

/// \param gap     of gap_between
/// \param reach  points farther apart are left out
void find_manifold(const ConvexPlace& a, const ConvexPlace& b, const Gap& gap, double reach,
                   const GapMemory& memory, ClipRoom& room, Manifold& out);

}  // namespace palpate::rendering
