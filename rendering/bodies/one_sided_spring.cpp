#include "rendering/bodies/one_sided_spring.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::rendering {
namespace {

/// s, until a freely growing depth reaches 0 from below; infinite if it does not.
double time_to_entry(double depth, double speed, double growth) {
  if (depth >= 0 && (speed > 0 || (speed == 0 && growth > 0) || depth > 0)) return 0;
  // depth + speed t + growth t^2 / 2 = 0, the first root after 0.
  const double under = speed * speed - 2 * growth * depth;
  if (under < 0) return HUGE_VAL;
  const double root = std::sqrt(under);
  if (speed > 0) return depth < 0 ? -2 * depth / (speed + root) : HUGE_VAL;
  if (growth > 0) return (root - speed) / growth;
  return HUGE_VAL;
}

}  // namespace

SpringPass pass_spring(const SpringStart& start, double duration) {
  constexpr int kMostEvents = 64;
  const double rate = std::sqrt(start.stiffness / start.mass);  // rad/s
  const double rest = start.growth / (rate * rate);             // m, where force and growth balance
  double depth = start.depth, speed = start.speed, left = duration;
  bool met = false;
  for (int event = 0; event < kMostEvents && left > 0; ++event) {
    const double entry = std::min(time_to_entry(depth, speed, start.growth), left);
    depth += entry * (speed + 0.5 * entry * start.growth);
    speed += entry * start.growth;
    left -= entry;
    if (left <= 0) break;
    met = true;
    depth = std::max(depth, 0.0);
    // depth(t) = rest + amplitude sin(rate t + phase)
    const double amplitude = std::hypot(depth - rest, speed / rate);
    const double phase = std::atan2(depth - rest, speed / rate);
    double inside = left;
    bool leaves = false;
    if (amplitude > rest) {
      double exit = std::numbers::pi + std::asin(std::min(1.0, std::max(-1.0, rest / amplitude)));
      if (exit - 2 * std::numbers::pi >= phase) exit -= 2 * std::numbers::pi;
      leaves = (exit - phase) / rate < left;
      if (leaves) inside = (exit - phase) / rate;
    }
    const double sine = std::sin(rate * inside), cosine = std::cos(rate * inside);
    const double end_speed = speed * cosine - rate * (depth - rest) * sine;
    depth = leaves ? 0 : rest + (depth - rest) * cosine + speed / rate * sine;
    speed = leaves ? std::min(end_speed, 0.0) : end_speed;
    left -= inside;
    if (leaves && speed == 0) break;
  }
  SpringPass pass;
  pass.depth = depth;
  pass.speed = speed;
  if (!met) return pass;
  // The spring's push is the free depth less the real one.
  const double free_speed = start.speed + duration * start.growth;
  const double free_depth = start.depth + duration * (start.speed + 0.5 * duration * start.growth);
  pass.impulse = start.mass * (free_speed - speed);
  pass.double_impulse = start.mass * (free_depth - depth);
  return pass;
}

}  // namespace palpate::rendering
