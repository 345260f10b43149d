#include "stimuli/orientation.h"

#include <cmath>

namespace palpate::stimuli {
namespace {

struct DiscPoint {
  double x, y, squared;
};

// Uniform in the open unit disc without its centre.
DiscPoint disc_point(Random& random) {
  DiscPoint point{};
  do {
    point.x = 2 * random.unit() - 1;
    point.y = 2 * random.unit() - 1;
    point.squared = point.x * point.x + point.y * point.y;
  } while (point.squared >= 1 || point.squared == 0);
  return point;
}

}  // namespace

Quat uniform_rotation(Random& random) {
  const DiscPoint first = disc_point(random);
  const DiscPoint second = disc_point(random);
  const double scale = std::sqrt((1 - first.squared) / second.squared);
  // q and -q are the same rotation; return the one with w >= 0.
  const double sign = first.x < 0 ? -1 : 1;
  return {sign * first.x, sign * first.y, sign * (second.x * scale), sign * (second.y * scale)};
}

}  // namespace palpate::stimuli
