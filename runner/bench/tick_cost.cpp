#include "runner/bench/tick_cost.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>

#include "rendering/renderer.h"
#include "runner/bench/tick_timer.h"
#include "runner/bench/union_cost.h"
#include "stimuli/primitives.h"
#include "stimuli/random.h"

namespace palpate::runner {
namespace {

constexpr double kRadius = 0.03;  // m
constexpr double kLength = 0.12;  // m, of the stylus
constexpr double kSpeed = 0.1;    // m/s
constexpr int kWarm = 1000;       // ticks
constexpr double kContactTarget = 100, kFreeTarget = 100, kFirstTarget = 2000,
                 kThousandTarget = 1000;  // ns

/// A random (seeded) path over a solid about the origin, 0.1 mm a tick. With the point renderer the
/// tip slides; with the ray the contact moves between the tip and 40 mm along the side.
class ScriptedHand {
 public:
  ScriptedHand(const rendering::Renderer& renderer, bool touching)
      : side_contact_(renderer.side_contact()), sign_(touching ? 1 : -1) {}

  /// The next pose. The radius is controlled by the last tick's `depth` (m; 0 in free space), so
  /// that the path follows the surface of any mesh.
  rendering::LineProbe next(double depth) {
    const double turn = 0.02 * random_.normal();
    heading_ = std::cos(turn) * heading_ + std::sin(turn) * glm::cross(normal_, heading_);
    normal_ = glm::normalize(normal_ + kSpeed * TickTimer::kTick / kRadius * heading_);
    heading_ = glm::normalize(heading_ - glm::dot(heading_, normal_) * normal_);
    ++tick_;
    const double wanted = 1.5e-3 + 0.5e-3 * std::sin(2 * std::numbers::pi * tick_ / 700.0);
    radius_ +=
        std::clamp(depth - sign_ * wanted, -kSpeed * TickTimer::kTick, kSpeed * TickTimer::kTick);
    double along =
        side_contact_ ? 0.01 + 0.03 * std::sin(2 * std::numbers::pi * tick_ / 3100.0) : -0.02;
    const double tilt = along < 0 ? -along / 0.02 * 0.8 : 0;
    along = std::max(0.0, along);
    const Vec3 axis = std::cos(tilt) * glm::cross(normal_, heading_) + std::sin(tilt) * normal_;
    const Vec3 tip = radius_ * normal_ - along * axis;
    return {tip, tip + kLength * axis};
  }

 private:
  stimuli::Random random_{1};
  bool side_contact_;
  double sign_;
  Vec3 normal_{0, 0, 1}, heading_{1, 0, 0};
  double radius_ = 1.5 * kRadius;
  double tick_ = 0;
};

struct Bench {
  std::string name;
  std::size_t triangles;
  rendering::Scene scene;  ///< with side contact
  double target_ns;        ///< in contact
};

/// m; depth of tip or side below the bounding sphere, negative outside.
double depth_below(const rendering::Scene& scene, const rendering::LineProbe& probe) {
  double gap = HUGE_VAL;
  const rendering::ScenePart& part = scene.parts()[0];
  const Vec3 d = probe.tail - probe.tip;
  const double fraction =
      std::clamp(glm::dot(part.sphere_centre - probe.tip, d) / glm::dot(d, d), 0.0, 1.0);
  gap = glm::length(probe.tip + fraction * d - part.sphere_centre) - part.sphere_radius;
  return -gap;
}

TickCost time_contact(TickTimer& timer, const rendering::Renderer& renderer, const Bench& bench,
                      std::size_t ticks) {
  rendering::RenderState state = bench.scene.initial_state();
  ScriptedHand hand(renderer, true);
  double depth = 0;
  for (int i = 0; i < kWarm; ++i)
    depth = renderer.tick(bench.scene, state, hand.next(depth), TickTimer::kTick).deepest.depth;
  for (std::size_t i = 0; i < 4 * ticks && timer.ticks() < ticks; ++i)
    depth = timer.tick(renderer, bench.scene, state, hand.next(depth), true).deepest.depth;
  return timer.take();
}

TickCost time_free_space(TickTimer& timer, const rendering::Renderer& renderer, const Bench& bench,
                         std::size_t ticks) {
  rendering::RenderState state = bench.scene.initial_state();
  ScriptedHand hand(renderer, false);
  double depth = -kRadius;
  for (std::size_t i = 0; i < kWarm + 4 * ticks && timer.ticks() < ticks; ++i) {
    const rendering::LineProbe probe = hand.next(depth);
    if (i < kWarm) {
      renderer.tick(bench.scene, state, probe, TickTimer::kTick);
    } else {
      timer.tick(renderer, bench.scene, state, probe, false);
    }
    depth = depth_below(bench.scene, probe);
  }
  return timer.take();
}

/// From a random direction and 10 mm away, drifting along the surface; with the ray every second
/// time the side first.
TickCost time_first_contact(TickTimer& timer, const rendering::Renderer& renderer,
                            const Bench& bench, std::size_t approaches) {
  stimuli::Random random(2);
  const auto any = [&] {
    return glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
  };
  // Some approaches miss.
  for (std::size_t i = 0; i < 4 * approaches && timer.ticks() < approaches; ++i) {
    rendering::RenderState state = bench.scene.initial_state();
    const Vec3 out = any(), level = glm::normalize(glm::cross(out, any()));
    const bool side = i % 2 == 0 && renderer.side_contact();
    const Vec3 axis = side ? level : glm::normalize(out + 0.3 * level);
    const double along = side ? 0.04 : 0;
    const std::size_t before = timer.ticks();
    for (int t = 0; t < 500 && timer.ticks() == before; ++t) {
      const Vec3 at =
          (1.2 * bench.scene.parts()[0].sphere_radius + 0.01 - t * kSpeed * TickTimer::kTick) *
              out +
          0.5 * t * kSpeed * TickTimer::kTick * glm::cross(out, level);
      const Vec3 tip = at - along * axis;
      timer.tick(renderer, bench.scene, state, {tip, tip + kLength * axis}, true);
    }
  }
  return timer.take();
}

rendering::Scene one(const std::shared_ptr<const stimuli::ConvexMesh>& mesh) {
  rendering::SceneObject object;
  object.mesh = mesh;
  return rendering::Scene({object});
}

/// A thousand spheres; the first at the origin, the others a grid about it, 0.3 m apart.
rendering::Scene thousand(const std::shared_ptr<const stimuli::ConvexMesh>& mesh) {
  const auto trees = std::make_shared<const rendering::ContactTrees>(*mesh, true);
  std::vector<rendering::SceneObject> objects;
  objects.reserve(1000);
  for (int i = 0; i < 1000; ++i) {
    rendering::SceneObject object;
    object.mesh = mesh;
    object.trees = trees;
    object.object = i;
    const int k = (i + 555) % 1000;  // puts the first in the middle
    object.pose.position = 0.3 * Vec3(k % 10 - 5, k / 10 % 10 - 5, k / 100 - 5);
    objects.push_back(std::move(object));
  }
  return rendering::Scene(std::move(objects));
}

std::vector<Bench> benches() {
  std::vector<Bench> all;
  const auto add = [&](std::string name, const stimuli::PolygonSoup& soup) {
    auto mesh = std::make_shared<const stimuli::ConvexMesh>(soup);
    all.push_back({std::move(name), soup.faces.size(), one(mesh), kContactTarget});
    return mesh;
  };
  std::shared_ptr<const stimuli::ConvexMesh> ball;
  for (const int subdivisions : {0, 3, 5, 7}) {
    const auto mesh = add("icosphere", stimuli::icosphere(kRadius, subdivisions));
    if (subdivisions == 3) ball = mesh;
  }
  add("cube", stimuli::cube(2 * kRadius));
  add("cone", stimuli::cone(kRadius, 2 * kRadius, 64));
  add("cylinder", stimuli::cylinder(kRadius, 2 * kRadius, 64));
  all.push_back({"icosphere, 1000 of them", 1280, thousand(ball), kThousandTarget});
  return all;
}

}  // namespace

std::vector<TickCost> measure_tick_costs(
    const TickCostSettings& settings, const std::function<void(std::size_t, std::size_t)>& done) {
  TickTimer timer;
  const std::vector<Bench> all = benches();
  std::vector<TickCost> rows;
  for (const Bench& bench : all) {
    for (const rendering::Renderer* renderer :
         {&rendering::point_renderer(), &rendering::ray_renderer()}) {
      const auto keep = [&](TickCost cost, const char* state, double target_ns) {
        cost.mesh = bench.name;
        cost.triangles = bench.triangles;
        cost.renderer = renderer->name();
        cost.state = state;
        cost.target_ns = target_ns;
        rows.push_back(std::move(cost));
        if (done) done(rows.size(), 6 * all.size() + kUnionCosts);
      };
      const std::size_t ticks = settings.ticks / kTickRounds;
      keep(least_disturbed([&] { return time_contact(timer, *renderer, bench, ticks); }), "contact",
           bench.target_ns);
      keep(least_disturbed([&] { return time_free_space(timer, *renderer, bench, ticks); }), "free",
           std::max(kFreeTarget, bench.target_ns));
      keep(least_disturbed(
               [&] { return time_first_contact(timer, *renderer, bench, settings.approaches); }),
           "first_contact", kFirstTarget);
    }
  }
  measure_union_costs(timer, settings.ticks, [&](TickCost cost) {
    rows.push_back(std::move(cost));
    if (done) done(rows.size(), 6 * all.size() + kUnionCosts);
  });
  return rows;
}

}  // namespace palpate::runner
