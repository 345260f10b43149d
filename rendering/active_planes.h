#pragma once
// The planes that hold an ideal tool at rest, at most three at once, and the nearest point that
// they allow, with each plane's share of the displacement. Any frame, m, unless said otherwise.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/contact_feature.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The half-space of points p with dot(normal, p) >= bound.
struct PlaneBound {
  Vec3 normal;       ///< unit, out of the obstacle
  double bound = 0;  ///< m
};

/// At most so many planes hold the ideal tool at once; at rest, at most three do.
inline constexpr std::size_t kMostPlanes = 8;

/// The point nearest to the origin, as the sum of multiplier * normal over the half-spaces, with
/// multipliers >= 0, at most three of them positive.
struct ConstrainedPoint {
  Vec3 point;
  std::array<double, kMostPlanes> multipliers{};  ///< m
  bool found = false;                             ///< the half-spaces have points in common
};

/// In closed form: tries a face, then an edge, then a vertex of the intersection, so that of planes
/// that agree within the tolerance the fewest carry.
/// \param half_spaces  up to kMostPlanes
/// \param tolerance    m; a half-space that is violated by no more than this is satisfied
ConstrainedPoint constrained_point(std::span<const PlaneBound> half_spaces, double tolerance);

/// Sine of half the opening of the narrowest groove that a tool turns into.
inline constexpr double kNarrowest = 5e-5;

/// In the narrowest groove, each of two planes bears this many times the force that pushes the tool
/// in. Where planes would bear more, the tool is clamped and the push is felt as one contact:
/// opposite forces 1e5 times the push would be mostly rounding, and so would their torque.
inline constexpr double kMostLeverage = 0.5 / kNarrowest;

/// A plane of a convex part that holds an ideal tool. Translations are relative to the virtual
/// tool's tip.
struct Plane {
  std::uint32_t near = 0;  ///< index of the pair in UnionMemory::near
  ContactFeature feature;
  Vec3 normal;            ///< world, out of the part
  double depth = 0;       ///< m, of the virtual tool below it: dot(normal, y) >= depth outside
  double multiplier = 0;  ///< m, of the normal in the way from the virtual to the ideal tool
  bool stays = false;     ///< returned where it had let go (rounding): do not let go there again
};

/// The planes in use, at most kMostPlanes.
/// \tparam Held  has the normal, depth and multiplier of Plane
template <class Held>
class PlanesOf {
 public:
  PlanesOf() {}  // NOLINT(modernize-use-equals-default): that would be deleted
  PlanesOf(const PlanesOf& other) { *this = other; }
  PlanesOf& operator=(const PlanesOf& other) {
    count_ = other.count_;
    std::copy_n(other.planes_.begin(), count_, planes_.begin());
    return *this;
  }
  std::span<Held> all() { return {planes_.data(), count_}; }
  std::span<const Held> all() const { return {planes_.data(), count_}; }
  /// Null if there is no plane.
  const Held* most_loaded() const {
    const Held* most = nullptr;
    for (const Held& plane : all()) {
      if (most == nullptr || plane.multiplier > most->multiplier) most = &plane;
    }
    return most;
  }
  /// Calls add(plane) for the planes that a tool at rest touches. One that is stuck, or clamped
  /// between planes that hold each other more than it, touches one plane across its way.
  /// \param shift  m, from the virtual to the ideal tool
  template <class Add>
  void for_each_contact(const Vec3& shift, bool stuck, const Add& add) const {
    const double length = glm::length(shift);
    const Held* const most = most_loaded();
    if (stuck || (most != nullptr && most->multiplier > kMostLeverage * length)) {
      if (most == nullptr || !(length > 0)) return;
      Held across = *most;
      across.normal = shift / length;
      across.multiplier = length;
      add(across);
      return;
    }
    for (const Held& plane : all()) {
      if (plane.multiplier > 0) add(plane);
    }
  }
  bool full() const { return count_ == planes_.size(); }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = 0; }
  void add(const Held& plane) { planes_[count_++] = plane; }
  /// Keeps the order; `drop` may change the planes that it keeps.
  template <class Drop>
  void remove_if(const Drop& drop) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (drop(planes_[i])) continue;
      if (kept != i) planes_[kept] = planes_[i];
      ++kept;
    }
    count_ = kept;
  }

  /// Whether the planes, all of which hold the tool, leave it room: false in a crack.
  bool leave_room() const {
    // Rounding hides the apex of a narrower groove; between abutting parts a tool would turn for
    // ever.
    if (count_ < 2) return true;
    if (count_ == 2) {
      const double cosine = glm::dot(planes_[0].normal, planes_[1].normal);
      return 1 + cosine > 2 * kNarrowest * kNarrowest;
    }
    std::array<PlaneBound, kMostPlanes> raised;
    for (std::size_t i = 0; i < count_; ++i) raised[i] = {planes_[i].normal, 1};
    const ConstrainedPoint out =
        constrained_point(std::span<const PlaneBound>(raised.data(), count_), 1e-6);
    return out.found && glm::dot(out.point, out.point) * (kNarrowest * kNarrowest) < 1;
  }

  /// Whether two planes face each other as the sides of a crack do.
  bool are_a_crack() const {
    for (std::size_t a = 0; a < count_; ++a) {
      for (std::size_t b = a + 1; b < count_; ++b) {
        if (1 + glm::dot(planes_[a].normal, planes_[b].normal) <= 2 * kNarrowest * kNarrowest)
          return true;
      }
    }
    return false;
  }

  /// The point nearest to `origin` at least `skin` above all planes; sets the multipliers.
  bool nearest(const Vec3& origin, double skin, double tolerance, Vec3& point) {
    std::array<PlaneBound, kMostPlanes> spaces;
    for (std::size_t i = 0; i < count_; ++i)
      spaces[i] = {planes_[i].normal,
                   planes_[i].depth + skin - glm::dot(planes_[i].normal, origin)};
    return solve(spaces, tolerance, origin, point);
  }

  /// The point nearest to the virtual tool (the origin), starting at `at`. Stays above each plane
  /// by `skin`, or by the height of `at` where that is less; crosses no plane that `at` is above,
  /// except by `rounding`.
  bool nearest_from(const Vec3& at, double skin, double tolerance, double rounding, Vec3& point) {
    std::array<PlaneBound, kMostPlanes> spaces;
    for (std::size_t i = 0; i < count_; ++i) {
      const double height = glm::dot(planes_[i].normal, at) - planes_[i].depth;
      spaces[i] = {planes_[i].normal, planes_[i].depth + std::min(skin, height)};
      if (height > 0) tolerance = std::clamp(0.5 * height, rounding, tolerance);
    }
    return solve(spaces, tolerance, Vec3(0), point);
  }

 private:
  bool solve(const std::array<PlaneBound, kMostPlanes>& spaces, double tolerance,
             const Vec3& origin, Vec3& point) {
    const ConstrainedPoint nearest =
        constrained_point(std::span<const PlaneBound>(spaces.data(), count_), tolerance);
    if (!nearest.found) return false;
    for (std::size_t i = 0; i < count_; ++i) planes_[i].multiplier = nearest.multipliers[i];
    point = origin + nearest.point;
    return true;
  }

  union {  // only those in use are initialised
    std::array<Held, kMostPlanes> planes_;
  };
  std::size_t count_ = 0;
};

using Planes = PlanesOf<Plane>;

}  // namespace palpate::rendering
