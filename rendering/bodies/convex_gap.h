#pragma once
// How far two convex parts are from each other and where they touch. World frame, m. Nothing here
// allocates.

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "rendering/first_contact.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A convex part where it is now.
struct ConvexPlace {
  const stimuli::ConvexMesh* mesh = nullptr;
  Mat3 axes;      ///< rotation from the mesh frame
  Vec3 position;  ///< of the mesh frame's origin
  Vec3 inside;    ///< a point inside, mesh frame

  Vec3 world_point(const Vec3& local) const { return axes * local + position; }
  /// Into the mesh frame, of a direction.
  Vec3 local_vector(const Vec3& world) const { return world * axes; }
};

/// What is remembered of a pair of parts from tick to tick.
struct GapMemory {
  Vec3 normal;  ///< of the last gap, zero at first
  std::uint32_t support_a = 0, support_b = 0;
  std::array<std::array<std::uint32_t, 2>, 3> nearest{};  ///< vertices of the last simplex
  std::uint32_t nearest_count = 0;
  double least = -HUGE_VAL;  ///< m; they were not nearer where PairPlaces says
};

/// A slab between two parts.
struct Gap {
  Vec3 normal;          ///< unit, from a to b
  double distance = 0;  ///< between the planes that touch a and b; negative where they overlap
  Vec3 on_a, on_b;      ///< the nearest points, where they are apart by less than `enough`
};

/// The slab of largest distance. Gilbert, Johnson & Keerthi 1988, of both parts made smaller by
/// 1e-4 of themselves about a point inside: touching parts are then well apart, and their normal is
/// that of the faces or edges, which does not change. Parts that overlap more than that are made
/// smaller still.
/// \param enough  a slab of this distance is as good as any larger
Gap gap_between(const ConvexPlace& a, const ConvexPlace& b, double enough, GapMemory& memory);

/// One place where two parts touch or nearly do.
struct ManifoldPoint {
  Vec3 place;      ///< half-way between the two
  double gap = 0;  ///< negative where they overlap
};

/// Where two parts touch: a face and the piece of the other part over it, or one point.
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

/// Room for polygons that are clipped.
struct ClipRoom {
  std::vector<Vec3> polygon, next;
  std::vector<ManifoldPoint> points;
};

/// \param gap     of gap_between \param reach  points that are farther apart are left out
void find_manifold(const ConvexPlace& a, const ConvexPlace& b, const Gap& gap, double reach,
                   const GapMemory& memory, ClipRoom& room, Manifold& out);

}  // namespace palpate::rendering
