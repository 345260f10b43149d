#include "rendering/accuracy/error_summary.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

ErrorSpread error_spread(std::vector<double> errors) {
  ErrorSpread s;
  s.count = errors.size();
  if (errors.empty()) return s;
  double squares = 0;
  for (const double e : errors) squares += e * e;
  const auto n = static_cast<double>(errors.size());
  s.rms = std::sqrt(squares / n);
  std::sort(errors.begin(), errors.end());
  s.p999 = errors[static_cast<std::size_t>(std::ceil(0.999 * n)) - 1];
  s.worst = errors.back();
  return s;
}

void ErrorTally::add(const LineProbe& probe, const std::vector<LocalDepth>& truth,
                     const ContactEstimate& estimate) {
  ++counts_.ticks;
  const bool gave_up = std::isnan(estimate.depth);
  const bool touching = estimate.touching && !gave_up;
  if (truth.empty()) {
    if (!touching) return;
    ++counts_.phantom;
    depth_.push_back(estimate.depth);
    force_.push_back(kStiffness * estimate.depth);
    return;
  }
  if (!touching) {
    ++counts_.lost;
    counts_.gave_up += gave_up ? 1 : 0;
    depth_.push_back(truth.front().depth);
    force_.push_back(kStiffness * truth.front().depth);
    return;
  }
  const LocalDepth& held =
      *std::max_element(truth.begin(), truth.end(), [&](const LocalDepth& a, const LocalDepth& b) {
        return glm::dot(a.normal, estimate.normal) < glm::dot(b.normal, estimate.normal);
      });
  // Depths equal within rounding count as the least: there an edge's two facets have the same
  // direction.
  counts_.deeper += held.depth > truth.front().depth + 1e-12 ? 1 : 0;
  const Vec3 exact_force = kStiffness * held.depth * held.normal;
  const Vec3 force = kStiffness * estimate.depth * estimate.normal;
  depth_.push_back(std::abs(estimate.depth - held.depth));
  normal_.push_back(angle_between(estimate.normal, held.normal));
  force_.push_back(glm::length(force - exact_force));
  if (held.flat_angle < kFlat || std::isnan(estimate.point.x)) return;
  const Vec3 exact_point =
      probe.tip + held.probe_fraction * (probe.tail - probe.tip) + held.depth * held.normal;
  point_.push_back(glm::length(estimate.point - exact_point));
  torque_.push_back(glm::length(glm::cross(estimate.point - probe.tip, force) -
                                glm::cross(exact_point - probe.tip, exact_force)));
}

ErrorSummary ErrorTally::summary() const {
  ErrorSummary s = counts_;
  s.depth = error_spread(depth_);
  s.normal = error_spread(normal_);
  s.point = error_spread(point_);
  s.force = error_spread(force_);
  s.torque = error_spread(torque_);
  return s;
}

}  // namespace palpate::rendering
