#include "runner/session/contact_log.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner {

void ContactLog::begin(const SharpEdges& edges, const Quat& orientation) {
  *this = {};
  edges_ = &edges;
  to_object_ = glm::conjugate(orientation);
}

void ContactLog::add(const Sample& sample) noexcept {
  ++ticks_;
  if (sample.rendering.contacts == 0) return;
  ++contact_ticks_;
  if (!edges_->too_many() && on_edge(sample.rendering.deepest.point)) ++edge_ticks_;
}

/// The distance to the edges changes by no more than the point moves: most ticks need no new one.
bool ContactLog::on_edge(const Vec3& point) noexcept {
  const Vec3 moved = point - known_;
  if (margin_ >= 0 && glm::dot(moved, moved) < margin_ * margin_) return known_on_edge_;
  const double distance = edges_->distance(to_object_ * point);
  constexpr double kRoundings = 1e-9;  // m
  known_ = point;
  margin_ = std::fmax(std::fabs(distance - kReach) - kRoundings, 0);
  known_on_edge_ = distance <= kReach;
  return known_on_edge_;
}

double ContactLog::contact_share() const {
  return ticks_ > 0 ? static_cast<double>(contact_ticks_) / static_cast<double>(ticks_) : 0;
}

std::optional<double> ContactLog::edge_dwell(double period) const {
  if (edges_->too_many()) return std::nullopt;
  return static_cast<double>(edge_ticks_) * period;
}

}  // namespace palpate::runner
