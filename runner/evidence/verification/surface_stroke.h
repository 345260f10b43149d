#pragma once
// A seeded hand that strokes any object by feel, for measurements: the same poses for all compared
// methods. World frame, SI units.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "data/base/random.h"
#include "rendering/probe.h"
#include "stimuli/vec.h"

namespace palpate::runner::evidence {

struct SurfaceStrokeSettings {
  Vec3 centre;                ///< m, of the object's bounding sphere
  double radius = 0.03;       ///< m, of that sphere; below 30 mm depth and speed shrink with it
  double length = 0.12;       ///< m, of the stylus
  bool side = true;           ///< the contact wanders between tip and side; else at the tip
  double lifted = 0;          ///< fraction of the time that the hand hovers 1 to 2 mm off
  double lift_period = 2000;  ///< ticks from one lift to the next
  std::uint64_t seed = 1;
};

/// 0.1 mm a tick along the surface (0.1 m/s at 1 kHz), up to twice that towards it or away, 1 to 2
/// mm deep. For the point renderer the tip slides; for the ray renderer the contact wanders between
/// the tip and 40 mm along the side. It starts half a radius off, 15 mm at most.
class SurfaceStroke {
 public:
  explicit SurfaceStroke(const SurfaceStrokeSettings& settings)
      : settings_(settings),
        random_(settings.seed),
        radius_(settings.radius + std::min(0.5 * settings.radius, 0.015)) {}

  /// The distance from the centre follows the penetration depth (m) at the last tick, so that the
  /// path keeps to the surface of any object. Negative: above it; 0: off it at an unknown distance.
  rendering::LineProbe next(double depth) {
    const double scale = std::min(1.0, settings_.radius / 0.03);
    const double step = 1e-4 * scale;  // m, of a tick
    const double turn = 0.02 * random_.normal();
    heading_ = std::cos(turn) * heading_ + std::sin(turn) * glm::cross(normal_, heading_);
    normal_ = glm::normalize(normal_ + step / settings_.radius * heading_);
    heading_ = glm::normalize(heading_ - glm::dot(heading_, normal_) * normal_);
    ++tick_;
    if (depth > 0) touched_radius_ = radius_;
    if (depth == 0) depth = std::min(0.0, touched_radius_ - radius_);
    const bool up =
        std::fmod(tick_, settings_.lift_period) >= (1 - settings_.lifted) * settings_.lift_period;
    const double size = scale * (1.5e-3 + 0.5e-3 * wave(700));
    radius_ += std::clamp(depth - (up ? -size : size), -2 * step, 2 * step);
    double along = settings_.side ? 0.01 + 0.03 * wave(3100) : -0.02;
    const double tilt = along < 0 ? -along / 0.02 * 0.8 : 0;
    along = std::max(0.0, along);
    const Vec3 axis = std::cos(tilt) * glm::cross(normal_, heading_) + std::sin(tilt) * normal_;
    const Vec3 tip = settings_.centre + radius_ * normal_ - along * axis;
    return {tip, tip + settings_.length * axis};
  }

 private:
  double wave(double period) const { return std::sin(2 * std::numbers::pi * tick_ / period); }

  SurfaceStrokeSettings settings_;
  Random random_;
  Vec3 normal_{0, 0, 1}, heading_{1, 0, 0};
  double radius_;
  double touched_radius_ = 0;
  double tick_ = 0;
};

}  // namespace palpate::runner::evidence
