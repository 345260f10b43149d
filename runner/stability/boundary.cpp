#include "runner/stability/boundary.h"

#include <cmath>

namespace palpate::runner {
namespace {

constexpr double kClose = 1.002;     // ratio at which the bisection ends
constexpr double kNoDamping = 1e-6;  // N s/m, practically none

stimuli::Material material_of(const LoopCase& loop, double stiffness) {
  stimuli::Material material;
  material.stiffness = stiffness;
  material.damping = loop.virtual_damping;
  constexpr double kLayerDepth = 0.5e-3;  // m; the contact is 1 mm deep
  if (loop.layer_share > 0)
    material.layers = {{.depth = kLayerDepth, .stiffness = loop.layer_share * stiffness}};
  return material;
}

double lever2(const LoopCase& loop) {
  return loop.settings.reach ? rendering::stiffness_gain(*loop.settings.reach, 0) : 1;
}

double felt_stiffness(const LoopCase& loop, double stiffness) {
  return stiffness * (1 + loop.layer_share) * lever2(loop);
}

LoopSettings settings_at(const LoopCase& loop, double stiffness, double damping) {
  LoopSettings settings = loop.settings;
  settings.damping = damping;
  if (loop.heavy)
    settings.mass = 100 * felt_stiffness(loop, stiffness) / (settings.rate * settings.rate);
  return settings;
}

}  // namespace

double passive_damping(const LoopCase& loop, double stiffness) {
  return felt_stiffness(loop, stiffness) / loop.settings.rate * (0.5 + loop.settings.delay) +
         std::abs(loop.virtual_damping) * lever2(loop);
}

bool is_stable(const LoopCase& loop, double stiffness, double damping) {
  const LoopScene scene(loop.contact_case, loop.renderer, material_of(loop, stiffness));
  return run_loop(settings_at(loop, stiffness, damping), scene).stable;
}

BoundaryPoint boundary_at(const LoopCase& loop, double stiffness) {
  const LoopSettings& s = loop.settings;
  BoundaryPoint point;
  point.stiffness = stiffness;
  point.theory = passive_damping(loop, stiffness);
  point.promised =
      s.resolution == 0 || felt_stiffness(loop, stiffness) <= 2 * s.friction / s.resolution;
  const LoopScene scene(loop.contact_case, loop.renderer, material_of(loop, stiffness));
  const auto stable = [&](double damping) {
    return run_loop(settings_at(loop, stiffness, damping), scene).stable;
  };
  double low = kNoDamping, high = point.theory;
  if (stable(low)) return point;
  while (!stable(high)) {
    low = high;
    high *= 2;
  }
  while (high > kClose * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? high : low) = middle;
  }
  point.measured = high;
  return point;
}

double stiffest_stable(const LoopCase& loop, double damping) {
  const auto stable = [&](double stiffness) { return is_stable(loop, stiffness, damping); };
  // In steps first: a stable stiffness beyond an unstable one would not count.
  constexpr double kStep = 1.15, kMost = 1e7;
  double low = 1;
  while (low < kMost && stable(kStep * low)) low *= kStep;
  if (low >= kMost) return kMost;
  double high = kStep * low;
  while (high > kClose * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace palpate::runner
