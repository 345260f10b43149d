#pragma once
// The planes that hold an ideal tool. Internal to the contact law of unions (union_contact.h).

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/active_planes.h"
#include "rendering/facet_walk.h"

namespace palpate::rendering {

/// Sine of half the opening of the narrowest groove that a tool turns into.
inline constexpr double kNarrowest = 5e-5;

/// In a groove as narrow two planes hold so many times what pushes the tool in. Where they hold
/// more, it is clamped, and what pushes it is felt as one contact: opposite forces of 1e5 times as
/// much would be rounding, and their torque would be no hand's.
inline constexpr double kMostLeverage = 0.5 / kNarrowest;

/// A plane that holds an ideal tool. Translations are relative to the virtual tool's tip.
struct Plane {
  std::uint32_t near = 0;  ///< index of the pair in UnionMemory::near
  ContactFeature feature;
  Vec3 normal;            ///< world, out of the part
  double depth = 0;       ///< m, of the virtual tool below it: dot(normal, y) >= depth outside
  double multiplier = 0;  ///< m, of the normal in the way from the virtual to the ideal tool
  bool stays = false;     ///< came back where it had let go: rounding, it is not let go there again
};

/// Those in use, at most kMostPlanes.
/// \tparam Held  has the normal, depth and multiplier of Plane
template <class Held>
class PlanesOf {
 public:
  std::span<Held> all() { return {planes_.data(), count_}; }
  std::span<const Held> all() const { return {planes_.data(), count_}; }
  /// Null where there is none.
  const Held* most_loaded() const {
    const Held* most = nullptr;
    for (const Held& plane : all()) {
      if (most == nullptr || plane.multiplier > most->multiplier) most = &plane;
    }
    return most;
  }
  bool full() const { return count_ == planes_.size(); }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = 0; }
  void add(const Held& plane) { planes_[count_++] = plane; }
  /// In order; `drop` may change what it keeps.
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

  /// Whether the planes, all of which hold the tool, leave it room: not where they are a crack.
  bool leave_room() const {
    // In narrower ones the apex is lost in rounding; between parts that abut a tool would turn for
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

  /// Whether two of them face each other as the sides of a crack do.
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

  /// The same to the virtual tool, from `at`: no plane asks for more than is there, and none that
  /// `at` is above is crossed, but for `rounding`.
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

  std::array<Held, kMostPlanes> planes_;
  std::size_t count_ = 0;
};

using Planes = PlanesOf<Plane>;

}  // namespace palpate::rendering
