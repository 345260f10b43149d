#include "runner/devices/falcon/kinematics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <optional>

#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr double kMaxStep = 0.02;     // m; beyond it the linear model is too inaccurate
constexpr double kConverged = 1e-11;  // rad, 1e-8 of a count
constexpr int kMaxIterations = 40;    // a warm start takes 4
constexpr int kMaxHalvings = 25;      // the step is then below the resolution of a double
constexpr double kSingular = 1e-6;    // volume of the unit rows

Vec3 residual_of(const Vec3& thighs, const Legs& legs) {
  return {thighs.x - legs[0].thigh, thighs.y - legs[1].thigh, thighs.z - legs[2].thigh};
}

/// Inverse of a matrix of three rows: its columns are their cross products over the determinant.
struct Inverse {
  std::array<Vec3, 3> columns;
  bool regular = false;

  explicit Inverse(const Jacobian& j) {
    const Vec3 c0 = glm::cross(j[1], j[2]), c1 = glm::cross(j[2], j[0]),
               c2 = glm::cross(j[0], j[1]);
    const double det = glm::dot(j[0], c0);
    const double size = glm::length(j[0]) * glm::length(j[1]) * glm::length(j[2]);
    regular = std::abs(det) > kSingular * size && std::isfinite(size);
    if (regular) columns = {c0 / det, c1 / det, c2 / det};
  }
};

bool within_reach(const Vec3& p) {
  return p.z >= kNearest && p.z <= kFarthest && std::hypot(p.x, p.y) <= kWidest;
}

}  // namespace

Vec3 thigh_angles(const Vec3& counts) { return kZeroAngle + kCountAngle * counts; }

Vec3 encoder_counts(const Vec3& thighs) { return (thighs - kZeroAngle) / kCountAngle; }

std::optional<Legs> inverse(const Vec3& p) noexcept {
  Legs legs;
  for (std::size_t i = 0; i < 3; ++i) {
    // Relative to the thigh's joint: u, w in the leg's plane, v at right angles to it.
    const double u = p.x * kLegCos[i] + p.y * kLegSin[i] - kBaseRadial + kGripRadial;
    const double v = -p.x * kLegSin[i] + p.y * kLegCos[i] - kBaseTangential + kGripTangential;
    const double w = p.z;
    const double lean = v / kShin;
    if (!(std::abs(lean) < 1)) return std::nullopt;
    const double tilt = std::acos(lean);
    const double shin = kShinEnds + kShin * std::sin(tilt);  // length of the shin in the plane
    const double reach2 = u * u + w * w;
    const double knee = (kThigh * kThigh + reach2 - shin * shin) / (2 * kThigh * std::sqrt(reach2));
    if (!(std::abs(knee) <= 1)) return std::nullopt;
    const double thigh = std::atan2(w, u) - std::acos(knee);
    legs[i] = {thigh, std::atan2(w - kThigh * std::sin(thigh), u - kThigh * std::cos(thigh)), tilt};
  }
  return legs;
}

Jacobian jacobian(const Legs& legs) noexcept {
  Jacobian j;
  for (std::size_t i = 0; i < 3; ++i) {
    const double lever = kThigh * std::sin(legs[i].shin - legs[i].thigh);
    const double slope = std::cos(legs[i].tilt) / std::sin(legs[i].tilt);
    const double along = std::cos(legs[i].shin);
    j[i] = Vec3(kLegCos[i] * along - kLegSin[i] * slope, kLegSin[i] * along + kLegCos[i] * slope,
                std::sin(legs[i].shin)) /
           lever;
  }
  return j;
}

std::optional<ForwardResult> forward(const Vec3& thighs, const Vec3& start) noexcept {
  ForwardResult at{start, 0};
  auto legs = inverse(at.position);
  if (!legs) {
    at.position = kCentre;
    legs = inverse(at.position);
  }
  Vec3 residual = residual_of(thighs, *legs);
  double error = glm::length(residual);
  while (!(error < kConverged)) {
    if (++at.iterations > kMaxIterations || !std::isfinite(error)) return std::nullopt;
    const Inverse j(jacobian(*legs));
    if (!j.regular) return std::nullopt;
    Vec3 step = j.columns[0] * residual.x + j.columns[1] * residual.y + j.columns[2] * residual.z;
    const double length = glm::length(step);
    if (length > kMaxStep) step *= kMaxStep / length;
    bool better = false;
    for (int halving = 0; halving < kMaxHalvings && !better; ++halving, step *= 0.5) {
      const Vec3 next = at.position + step;
      const auto next_legs = inverse(next);
      if (!next_legs) continue;
      const Vec3 next_residual = residual_of(thighs, *next_legs);
      if (!(glm::length(next_residual) < error)) continue;
      better = true;
      at.position = next;
      legs = next_legs;
      residual = next_residual;
      error = glm::length(residual);
    }
    if (!better) return std::nullopt;
  }
  if (!within_reach(at.position)) return std::nullopt;
  return at;
}

std::optional<Vec3> torque_for(const Jacobian& j, const Vec3& force) noexcept {
  const Inverse inverse_of_j(j);
  if (!inverse_of_j.regular) return std::nullopt;
  const auto& c = inverse_of_j.columns;
  return Vec3(glm::dot(c[0], force), glm::dot(c[1], force), glm::dot(c[2], force));
}

Vec3 force_of(const Jacobian& j, const Vec3& torque) noexcept {
  return torque.x * j[0] + torque.y * j[1] + torque.z * j[2];
}

double force_in_every_direction(const Vec3& position, double max_torque) noexcept {
  const auto legs = inverse(position);
  if (!legs) return 0;
  const Inverse j(jacobian(*legs));
  if (!j.regular) return 0;
  // A motor's torque is largest for forces along its column of the inverse.
  return max_torque / std::max({glm::length(j.columns[0]), glm::length(j.columns[1]),
                                glm::length(j.columns[2])});
}

}  // namespace palpate::runner::devices::falcon
