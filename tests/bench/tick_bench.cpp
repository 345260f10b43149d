// What a tick costs in sustained contact: an icosphere of 30 mm radius, the hand at 0.1 m/s, 1 to 2
// mm deep, the contact wandering between the tip and the side of a 0.12 m stylus. Prints
// nanoseconds a tick. Every tick is timed alone with the processor's time stamp counter; the cost
// of reading it is shown beside and not taken off.

#include <x86intrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <vector>

#include "rendering/renderer.h"
#include "stimuli/primitives.h"
#include "stimuli/random.h"

namespace {

using namespace palpate;

constexpr double kRadius = 0.03, kLength = 0.12, kSpeed = 0.1, kTick = 1e-3;

/// A seeded path over the solid, 0.1 mm a tick. For the point, the tip slides; for the ray, the
/// contact wanders between the tip and 40 mm along the side. How far out the path runs follows the
/// depth that was rendered, so that contact is sustained on coarse meshes as well.
class Path {
 public:
  Path(std::uint64_t seed, bool side_contact) : random_(seed), side_contact_(side_contact) {}

  LineProbe next(double rendered_depth) {
    const double turn = 0.02 * random_.normal();
    heading_ = std::cos(turn) * heading_ + std::sin(turn) * glm::cross(normal_, heading_);
    normal_ = glm::normalize(normal_ + kSpeed * kTick / kRadius * heading_);
    heading_ = glm::normalize(heading_ - glm::dot(heading_, normal_) * normal_);
    ++tick_;
    const double depth = 1.5e-3 + 0.5e-3 * std::sin(2 * std::numbers::pi * tick_ / 700.0);
    radius_ += std::clamp(rendered_depth - depth, -kSpeed * kTick, kSpeed * kTick);
    double along =
        side_contact_ ? 0.01 + 0.03 * std::sin(2 * std::numbers::pi * tick_ / 3100.0) : -0.02;
    const double tilt = along < 0 ? -along / 0.02 * 0.8 : 0;
    along = std::max(0.0, along);
    const Vec3 axis = std::cos(tilt) * glm::cross(normal_, heading_) + std::sin(tilt) * normal_;
    const Vec3 tip = radius_ * normal_ - along * axis;
    return {tip, tip + kLength * axis};
  }

 private:
  Random random_;
  bool side_contact_;
  Vec3 normal_{0, 0, 1}, heading_{1, 0, 0};
  double radius_ = kRadius;
  double tick_ = 0;
};

double nanoseconds_per_count() {
  const auto start = std::chrono::steady_clock::now();
  const auto count = __rdtsc();
  while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(200)) {
  }
  const auto counts = static_cast<double>(__rdtsc() - count);
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start)
             .count() /
         counts;
}

struct Spread {
  double median = 0, p99 = 0, worst = 0;
};

Spread spread(std::vector<std::uint32_t>& counts, double ns) {
  const auto at = [&](double share) {
    const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(counts.size() - 1));
    std::nth_element(counts.begin(), counts.begin() + k, counts.end());
    return counts[static_cast<std::size_t>(k)] * ns;
  };
  return {at(0.5), at(0.99), at(1.0)};
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t ticks = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000;
  const double ns = nanoseconds_per_count();
  std::vector<std::uint32_t> counts(ticks), empty(ticks);
  for (auto& count : empty) {
    const auto start = __rdtsc();
    unsigned core;
    count = static_cast<std::uint32_t>(__rdtscp(&core) - start);
  }
  std::printf(
      "icosphere 30 mm, 0.1 m/s, 1 to 2 mm deep, %zu ticks a row; ns a tick; an empty tick reads "
      "%.0f\n",
      ticks, spread(empty, ns).median);
  std::printf("%-8s%10s%10s%10s%12s%14s%12s\n", "probe", "triangles", "median", "p99", "worst",
              "in contact %", "growth");
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    double first = 0;
    for (int subdivisions = 0; subdivisions <= 7; ++subdivisions) {
      const auto mesh = std::make_shared<const ConvexMesh>(icosphere(kRadius, subdivisions));
      const Scene scene({{mesh, Pose{}, Material{}, 0, nullptr}}, renderer->side_contact());
      RenderState state = scene.initial_state();
      Path path(1, renderer->side_contact());
      renderer->tick(scene, state, {Vec3(0, 0, 0.2), Vec3(0, 0, 0.2 + kLength)}, kTick);
      double depth = 0;
      for (int i = 0; i < 1000; ++i)
        depth = renderer->tick(scene, state, path.next(depth), kTick).deepest.depth;
      std::size_t touching = 0;
      for (auto& count : counts) {
        const LineProbe probe = path.next(depth);
        unsigned core;
        const auto start = __rdtsc();
        const Rendering rendering = renderer->tick(scene, state, probe, kTick);
        count = static_cast<std::uint32_t>(__rdtscp(&core) - start);
        depth = rendering.deepest.depth;
        touching += rendering.contacts > 0 ? 1 : 0;
      }
      const Spread s = spread(counts, ns);
      if (subdivisions == 0) first = s.median;
      std::printf("%-8s%10d%10.0f%10.0f%12.0f%14.1f%11.2fx\n", renderer->name(),
                  20 << (2 * subdivisions), s.median, s.p99, s.worst,
                  100.0 * static_cast<double>(touching) / static_cast<double>(ticks),
                  s.median / first);
    }
  }
}
