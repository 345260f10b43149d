#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/facet_walk.h"
#include "rendering/probes.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering::tick {
namespace {

/// The sides of a facet, in order about its normal, with the line across it.
class CrossedFacet {
 public:
  CrossedFacet(const stimuli::ConvexMesh& mesh, std::uint32_t index, const Vec3& tip, const Vec3& d)
      : mesh_(mesh),
        index_(index),
        facet_(mesh.facets()[index]),
        sides_(&mesh.sides()[facet_.first_side]),
        tip_(tip),
        left_(glm::cross(facet_.normal, d)),
        ahead_(glm::cross(facet_.normal, sides_[0].inward)) {}

  std::uint32_t count() const { return facet_.side_count; }
  const stimuli::Side& side(std::uint32_t i) const { return sides_[i % count()]; }
  /// Where side i begins: how far to the left of the line, times the length of d.
  double height(std::uint32_t i) const {
    return glm::dot(left_, minkowski::corner(mesh_, index_, side(i)) - tip_);
  }

  /// The first side whose inward normal is turned farther about the facet's normal, from that of
  /// side 0, than `direction`; count(): none.
  std::uint32_t first_after(const Vec3& direction) const {
    const bool far = is_far(direction);
    std::uint32_t low = 0, high = count();
    while (low < high) {
      const std::uint32_t middle = (low + high) / 2;
      const Vec3& inward = sides_[middle].inward;
      const bool inward_far = is_far(inward);
      const bool after = inward_far != far
                             ? inward_far
                             : glm::dot(facet_.normal, glm::cross(direction, inward)) > 0;
      (after ? high : low) = after ? middle : middle + 1;
    }
    return low;
  }
  /// The first of the sides by which the line enters the facet.
  std::uint32_t first_entered() const { return first_after(-left_); }
  /// The first of those by which it leaves.
  std::uint32_t first_left() const { return first_after(left_); }

 private:
  /// Turned by more than half a turn.
  bool is_far(const Vec3& direction) const {
    const double over = glm::dot(direction, ahead_);
    return over < 0 || (over == 0 && glm::dot(direction, sides_[0].inward) < 0);
  }

  const stimuli::ConvexMesh& mesh_;
  std::uint32_t index_;
  const stimuli::Facet& facet_;
  const stimuli::Side* sides_;
  Vec3 tip_, left_, ahead_;
};

/// The side of first, first + 1, ..., of `length`, on which the corners' heights change sign.
/// \param falling  the heights fall along them
std::uint32_t crossed_side(const CrossedFacet& facet, std::uint32_t first, std::uint32_t length,
                           bool falling) {
  std::uint32_t low = 0, high = length;
  while (high - low > 1) {
    const std::uint32_t middle = (low + high) / 2;
    ((facet.height(first + middle) >= 0) == falling ? low : high) = middle;
  }
  return first + low;
}

}  // namespace

void Portion::clip_by_many(const stimuli::ConvexMesh& mesh, std::uint32_t facet, const Vec3& tip,
                           const Vec3& d, double slack) {
  const CrossedFacet crossed(mesh, facet, tip, d);
  const std::uint32_t count = crossed.count();
  const auto clip_around = [&](std::uint32_t side) {
    // Neighbours, too: rounding may put the change of sign one side off.
    for (std::uint32_t i = side + count - 2; i <= side + count + 2; ++i) {
      const stimuli::Side& at = crossed.side(i);
      clip(glm::dot(at.inward, tip) - at.offset + slack, glm::dot(at.inward, d));
    }
  };
  const std::uint32_t in = crossed.first_entered() % count, out = crossed.first_left() % count;
  const std::uint32_t entered = (out + count - in) % count;
  clip_around(in);
  clip_around(out);
  if (entered > 0) clip_around(crossed_side(crossed, in, entered, true));
  if (entered < count) clip_around(crossed_side(crossed, out, count - entered, false));
}

}  // namespace palpate::rendering::tick
