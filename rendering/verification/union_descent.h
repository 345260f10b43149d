#pragma once
// Steepest descent of a point towards another one outside of convex sums, each given by all of its
// planes. Of union_oracle.cpp alone.

#include <vector>

#include "rendering/verification/nearest_point.h"
#include "rendering/verification/union_oracle.h"

namespace palpate::rendering {

/// Fraction of what counts as touching by which a goal may lie below a plane.
inline constexpr double kRoundingOfTouching = 1e-2;

/// Where the tip would go next.
struct Choice {
  std::vector<const OracleSum*> touched;
  std::vector<HalfSpace> planes;  ///< a facet of each
  NearestPoint goal;              ///< above them
  bool on_one_facet_each = true;  ///< no sum is touched on an edge
};

/// Steepest descent of the distance from the virtual tip. Near the tip the free space is what lies
/// above one touched facet of every touched sum, any of them: of all the choices that is steepest
/// whose nearest point to the virtual tip is nearest.
class Descent {
 public:
  /// \param touching  m; sums no further away are touched
  Descent(const std::vector<OracleSum>& sums, const Vec3& virtual_tip, double touching)
      : sums_(sums), virtual_tip_(virtual_tip), touching_(touching) {}

  /// Where the tip would go if the facets that it touches had no end and nothing else were in the
  /// way. \return false when rounding leaves no such point
  bool goal(const Vec3& tip, Choice& best);

  /// m; what of the way from the virtual tip is no sum of non-negative multiples of the normals of
  /// facets that are touched, each at most `most_multiple` times as long as the way.
  double unbalanced(const Vec3& tip, double most_multiple) const;

  /// How much of the straight way to the goal lies outside all sums, with the facets of the choice
  /// bounding those that are touched. In [0, 1].
  double free_way(const Vec3& tip, const Vec3& goal) const;

 private:
  struct Touched {
    const OracleSum* sum;
    std::vector<std::size_t> facets;
  };

  void choose(std::size_t next, std::vector<HalfSpace>& planes, Choice& best);
  double slides_off(const OracleSum& sum, const Vec3& tip, const Vec3& goal) const;

  const std::vector<OracleSum>& sums_;
  Vec3 virtual_tip_;
  double touching_;
  std::vector<Touched> touched_;
  double best_distance_ = 0;
  bool in_crack_ = false;
};

}  // namespace palpate::rendering
