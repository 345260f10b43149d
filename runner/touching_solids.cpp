#include "runner/touching_solids.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <utility>

#include "rendering/bodies/soft/segment_triangle.h"

namespace palpate::runner {
namespace {

using Triangle = std::array<Vec3, 3>;

double distance_between(const Triangle& a, const Triangle& b) {
  double least = HUGE_VAL;
  for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (std::size_t k = 0; k < 3; ++k) {
      least = std::min(least,
                       rendering::distance_to_triangle({(*one)[k], (*one)[(k + 1) % 3] - (*one)[k]},
                                                       (*other)[0], (*other)[1], (*other)[2]));
    }
  }
  return least;
}

struct Boxed {
  Vec3 low, high;
  const Triangle* triangle;
};

bool boxes_meet(const Vec3& low_a, const Vec3& high_a, const Vec3& low_b, const Vec3& high_b,
                double within) {
  return low_a.x <= high_b.x + within && low_b.x <= high_a.x + within &&
         low_a.y <= high_b.y + within && low_b.y <= high_a.y + within &&
         low_a.z <= high_b.z + within && low_b.z <= high_a.z + within;
}

/// The triangles of one surface near another one's box, from the lowest along an axis on.
std::vector<Boxed> near(const StandingSurface& of, const StandingSurface& to, double within,
                        int axis) {
  std::vector<Boxed> out;
  for (const Triangle& t : of.triangles) {
    const Vec3 low = glm::min(t[0], glm::min(t[1], t[2])),
               high = glm::max(t[0], glm::max(t[1], t[2]));
    if (boxes_meet(low, high, to.low, to.high, within)) out.push_back({low, high, &t});
  }
  std::ranges::sort(out,
                    [axis](const Boxed& a, const Boxed& b) { return a.low[axis] < b.low[axis]; });
  return out;
}

}  // namespace

StandingSurface standing(std::span<const stimuli::SurfaceShell> shells) {
  StandingSurface out;
  out.low = Vec3(HUGE_VAL);
  out.high = -out.low;
  for (const stimuli::SurfaceShell& shell : shells) {
    std::vector<Vec3> vertices = shell.surface->vertices;
    for (Vec3& v : vertices) {
      v = shell.pose.orientation * v + shell.pose.position;
      out.low = glm::min(out.low, v);
      out.high = glm::max(out.high, v);
    }
    for (const auto& t : shell.surface->triangles)
      out.triangles.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
    out.error = std::max(out.error, shell.surface->coordinate_error + shell.pose_error);
  }
  constexpr double kRounding = 1e-12;  // of the distance from the origin
  out.error += kRounding * std::max(glm::length(out.low), glm::length(out.high));
  return out;
}

bool touch(const StandingSurface& a, const StandingSurface& b) {
  const double within = a.error + b.error;
  if (!boxes_meet(a.low, a.high, b.low, b.high, within)) return false;
  // Sweep along the longest way that they have in common.
  const Vec3 common = glm::min(a.high, b.high) - glm::max(a.low, b.low);
  int axis = common.y > common.x ? 1 : 0;
  if (common.z > common[axis]) axis = 2;
  const std::vector<Boxed> of_a = near(a, b, within, axis), of_b = near(b, a, within, axis);
  std::vector<const Boxed*> open;  // of b, whose upper end may still be ahead
  std::size_t next = 0;
  for (const Boxed& one : of_a) {
    for (; next < of_b.size() && of_b[next].low[axis] <= one.high[axis] + within; ++next)
      open.push_back(&of_b[next]);
    std::erase_if(open,
                  [&](const Boxed* other) { return other->high[axis] + within < one.low[axis]; });
    for (const Boxed* other : open) {
      if (boxes_meet(one.low, one.high, other->low, other->high, within) &&
          distance_between(*one.triangle, *other->triangle) <= within)
        return true;
    }
  }
  return false;
}

}  // namespace palpate::runner
