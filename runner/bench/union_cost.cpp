#include "runner/bench/union_cost.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/primitives.h"

namespace palpate::runner {
namespace {

constexpr double kPartRadius = 0.03, kRing = 0.05;  // m, of a ball, and of their centres
constexpr double kToolLength = 0.12;                // m, of the stylus
constexpr double kArm = 0.06;                       // m, of the cross
constexpr double kStep = 1e-4;                      // m a tick
constexpr int kWarmTicks = 1000;                    // ticks
constexpr double kTarget = 2000;                    // ns, of p99
constexpr double kFar = 0.3;                        // m, between balls out of reach

using Mesh = std::shared_ptr<const stimuli::ConvexMesh>;

struct UnionBench {
  std::string name;
  std::size_t triangles = 0, near = 10, far = 0, segments = 3;
};

rendering::Scene ring(const UnionBench& bench, const Mesh& mesh) {
  const auto trees = std::make_shared<const rendering::ContactTrees>(*mesh, true);
  std::vector<rendering::SceneObject> balls;
  const auto add = [&](const Vec3& at) {
    rendering::SceneObject ball;
    ball.mesh = mesh;
    ball.trees = trees;
    ball.pose.position = at;
    balls.push_back(std::move(ball));
  };
  for (std::size_t i = 0; i < bench.near; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / 10;
    add(kRing * Vec3(std::cos(angle), std::sin(angle), 0));
  }
  for (std::size_t i = 0; i < bench.far; ++i) {
    const std::size_t column = i % 10, row = i / 10 % 10, floor = i / 100;
    add(Vec3(0, 0, -1) + kFar * Vec3(static_cast<double>(column) - 5, static_cast<double>(row) - 5,
                                     -static_cast<double>(floor)));
  }
  rendering::Tool tool;
  if (bench.segments == 3) {
    tool.segments = {{Vec3(0), Vec3(0, 0, kToolLength)},
                     {Vec3(-kArm, 0, 0), Vec3(kArm, 0, 0)},
                     {Vec3(0, -kArm, 0), Vec3(0, kArm, 0)}};
  }
  return rendering::Scene(std::move(balls), true, std::move(tool));
}

/// The hand goes round over the ring, turns and tilts; its height follows the depth of contact.
class RingHand {
 public:
  /// \param round  m, radius of its way
  explicit RingHand(double round) : round_(round) {}

  rendering::LineProbe next(double depth, rendering::RenderState& state) {
    ++tick_;
    const double wanted = 1.5e-3 + 0.5e-3 * std::sin(2 * std::numbers::pi * tick_ / 700);
    height_ += std::clamp(depth - wanted, -kStep, kStep);
    const double round = tick_ * kStep / round_;
    const double turn = 1e-3 * tick_, tilt = 0.15 * std::sin(2e-3 * tick_);
    const Vec3 axis(std::sin(tilt) * std::cos(3 * round), std::sin(tilt) * std::sin(3 * round),
                    std::cos(tilt));
    state.measured_side = {std::cos(turn), std::sin(turn), 0};
    const Vec3 tip(round_ * std::cos(round), round_ * std::sin(round), height_);
    return {tip, tip + kToolLength * axis};
  }

 private:
  double round_;
  double height_ = kPartRadius + 0.02;
  double tick_ = 0;
};

TickCost time_ring(TickTimer& timer, const rendering::Scene& scene, double round,
                   std::size_t ticks) {
  const rendering::Renderer& renderer = rendering::ray_renderer();
  rendering::RenderState state = scene.initial_state();
  RingHand hand(round);
  double depth = 0;
  for (int i = 0; i < kWarmTicks; ++i) {
    const rendering::LineProbe probe = hand.next(depth, state);
    depth = renderer.tick(scene, state, probe, TickTimer::kTick).deepest.depth;
  }
  for (std::size_t i = 0; i < 4 * ticks && timer.ticks() < ticks; ++i) {
    const rendering::LineProbe probe = hand.next(depth, state);
    depth = timer.tick(renderer, scene, state, probe, true).deepest.depth;
  }
  return timer.take();
}

}  // namespace

void measure_union_costs(TickTimer& timer, std::size_t ticks,
                         const std::function<void(TickCost)>& keep) {
  const UnionBench benches[kUnionCosts] = {{"10 balls, tool of 3", 20},
                                           {"10 balls, tool of 3", 1280},
                                           {"10 balls, tool of 3", 20480},
                                           {"10 balls, tool of 3", 327680},
                                           {"10 and 990 far, of 3", 1280, 10, 990},
                                           {"10 balls, stylus", 1280, 10, 0, 1},
                                           {"1 ball, tool of 3", 1280, 1}};
  for (const UnionBench& bench : benches) {
    const int subdivisions = bench.triangles == 20      ? 0
                             : bench.triangles == 1280  ? 3
                             : bench.triangles == 20480 ? 5
                                                        : 7;
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(kPartRadius, subdivisions));
    // The cross lies over the ring's hollow; the stylus alone is led over the tops of the balls.
    const double round = bench.segments == 3 ? 0.015 : kRing;
    const rendering::Scene scene = ring(bench, mesh);
    TickCost cost =
        least_disturbed([&] { return time_ring(timer, scene, round, ticks / kTickRounds); });
    cost.mesh = bench.name;
    cost.triangles = bench.triangles;
    cost.parts = bench.near + bench.far;
    cost.near_parts = bench.near;
    cost.segments = bench.segments;
    cost.renderer = "ray";
    cost.state = "contact";
    cost.target_ns = kTarget;
    cost.target_is_p99 = true;
    keep(std::move(cost));
  }
}

}  // namespace palpate::runner
