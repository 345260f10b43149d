#pragma once
// Touched parts of a surface. Object's frame, m.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::analysis {

using SurfaceTriangle = std::array<Vec3, 3>;

/// Points distributed uniformly on a surface with a fixed seed: the same surface has the same
/// points.
std::vector<Vec3> draw_places(const std::vector<SurfaceTriangle>& surface, std::size_t count);

/// A surface to count touches on.
class TouchedSurface {
 public:
  static constexpr std::size_t kPlaces = 10000, kParts = 64;
  static constexpr double kReach = 0.005;  ///< m

  /// \param places  uniform on it, at least kParts. They are halved six times across the longest
  /// side of their box: 64 parts of equal area.
  explicit TouchedSurface(std::vector<Vec3> places);

  /// Share of the places within kReach of the points so far, after each point.
  std::vector<double> coverage(const std::vector<Vec3>& points) const;
  std::size_t part_of(const Vec3& point) const;
  const std::vector<Vec3>& places() const { return places_; }

 private:
  struct Split {
    int axis = 0;
    double at = 0;
  };
  void divide(std::vector<Vec3>& places, std::size_t begin, std::size_t end, std::size_t node);
  std::array<std::int64_t, 3> cell_of(const Vec3& point) const;

  std::vector<Vec3> places_;
  std::array<Split, kParts> splits_{};
  Vec3 corner_{0, 0, 0};
  double cell_ = kReach;  ///< m, at least kReach
  std::array<std::int64_t, 3> cells_{};
  std::vector<std::vector<std::uint32_t>> grid_;  ///< places by cell
};

/// Shannon entropy of the parts' shares over log2 K, with the bias correction of Miller and Madow
/// for the number of ticks; at most 1. None: no tick.
std::optional<double> entropy(const std::vector<std::size_t>& parts);
/// Number of changes of part between consecutive ticks.
std::size_t transitions(const std::vector<std::size_t>& parts);

}  // namespace palpate::analysis
