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
  return material;
}

LoopSettings settings_at(const LoopCase& loop, double stiffness, double damping) {
  LoopSettings settings = loop.settings;
  settings.damping = damping;
  if (loop.heavy) settings.mass = 100 * stiffness / (settings.rate * settings.rate);
  return settings;
}

}  // namespace

double passive_damping(const LoopCase& loop, double stiffness) {
  return stiffness / loop.settings.rate * (0.5 + loop.settings.delay) +
         std::abs(loop.virtual_damping);
}

BoundaryPoint boundary_at(const LoopCase& loop, double stiffness) {
  const LoopSettings& s = loop.settings;
  BoundaryPoint point;
  point.stiffness = stiffness;
  point.theory = passive_damping(loop, stiffness);
  point.promised = s.resolution == 0 || stiffness <= 2 * s.friction / s.resolution;
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
  const auto stable = [&](double stiffness) {
    const LoopScene scene(loop.contact_case, loop.renderer, material_of(loop, stiffness));
    return run_loop(settings_at(loop, stiffness, damping), scene).stable;
  };
  // In steps first: beyond the first instability there may be stable stiffnesses again, which do
  // not count.
  constexpr double kStep = 1.5, kMost = 1e7;
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
