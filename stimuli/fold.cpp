#include "stimuli/fold.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::stimuli {

Reach::Reach(const Vec3& side) : along_(glm::normalize(side)), length_(glm::length(side)) {}

void Reach::include(const Vec3& arm) {
  const double t = glm::dot(arm, along_);
  across_ = std::max(across_, glm::length(arm - t * along_));
  overhang_ = std::max({overhang_, -t / length_, t / length_ - 1});
}

double fold(const Vec3& normal, const Vec3& normal_across, const Vec3& side, const Reach& reach,
            const Reach& reach_across, double error) {
  const double sine = glm::dot(glm::cross(normal, normal_across), glm::normalize(side));
  // Past a right angle the sine falls again, the fold does not. At more than 60 degrees polygons
  // are not one plane, however little is known of them.
  const bool sharp = glm::dot(normal, normal_across) < 0.5;
  const double near = reach.across(), far = reach_across.across();
  const double moved = (sharp ? 1 : std::abs(sine)) * near * far / (near + far);
  const double lever = 1 + std::max(reach.overhang(), reach_across.overhang());
  double folded = moved / (error * lever);
  if (sharp) folded = std::max(folded, 2 * kCoplanar);
  return std::copysign(folded, sine);
}

}  // namespace palpate::stimuli
