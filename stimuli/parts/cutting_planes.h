#pragma once
// Which plane to cut a cell of a concave solid by next.

#include <vector>

#include "stimuli/parts/facets.h"

namespace palpate::stimuli {

/// Any plane through a concave edge that runs on into the notch leaves convex corners on both
/// sides. Those of the two facets do; so does the one that halves the notch, and planes that hold
/// further concave edges do the work of several.
class CuttingPlanes {
 public:
  /// Adds its planes to the table. `solid` must outlive it.
  CuttingPlanes(const FacetedSolid& solid, PlaneTable& planes);

  /// That which cuts most concave edges of the cell apart and tears fewest others.
  std::uint32_t best(const Cell& cell) const;

  /// Hands the ridges of a cell that is cut by a plane on to its halves; drops those that are
  /// convex in both.
  void divide_ridges(const std::vector<Ridge>& ridges, std::uint32_t plane, CutCell& halves) const;

 private:
  void add(std::uint32_t edge, const Vec3& normal, std::vector<Vec3> points);
  void add_pair(std::uint32_t a, std::uint32_t b);
  double gain(std::uint32_t edge, std::uint32_t plane) const;

  const FacetedSolid& solid_;
  PlaneTable& planes_;
  std::vector<std::vector<std::uint32_t>> through_;  // of each concave edge
};

}  // namespace palpate::stimuli
