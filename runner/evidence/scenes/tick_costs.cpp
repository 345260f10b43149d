#include "runner/evidence/scenes/tick_costs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <utility>

#include "data/base/random.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/first_contact.h"
#include "rendering/renderer.h"
#include "runner/evidence/tick_meters.h"
#include "runner/scene_builder.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

/// Times ticks one by one.
class TickTimer {
 public:
  static constexpr double kTick = 1e-3;  ///< s

  TickTimer() : ns_(evidence::nanoseconds_per_count()) {
    std::vector<std::uint64_t> empty(100'000);
    for (auto& count : empty) {
      const std::uint64_t start = evidence::begin_count();
      count = evidence::end_count() - start;
    }
    empty_ns_ = at(empty, 0.5);
  }

  /// Runs one tick; records its time if its state of contact is the wanted one.
  rendering::Rendering tick(const rendering::Renderer& renderer, const rendering::Scene& scene,
                            rendering::RenderState& state, const rendering::LineProbe& probe,
                            bool touching_wanted) {
    if (cold_) forget();
    const std::uint64_t allocated = evidence::allocations();
    const std::uint64_t start = evidence::begin_count();
    rendering::Rendering rendering = renderer.tick(scene, state, probe, kTick);
    const std::uint64_t count = evidence::end_count() - start;
    allocations_ += evidence::allocations() - allocated;
    if ((rendering.contacts > 0) == touching_wanted) counts_.push_back(count);
    return rendering;
  }

  std::size_t ticks() const { return counts_.size(); }
  /// Whether to clear the near caches before each tick, as the rest of a millisecond does at 1 kHz.
  void set_cold(bool cold) { cold_ = cold; }

  /// Returns the statistics of the row and starts a new one.
  TickCost take() {
    TickCost cost;
    cost.ticks = counts_.size();
    if (!counts_.empty()) {
      cost.median_ns = at(counts_, 0.5);
      cost.p99_ns = at(counts_, 0.99);
      cost.max_ns = at(counts_, 1);
    }
    cost.allocations = allocations_;
    cost.empty_loop_ns = empty_ns_;
    cost.cold = cold_;
    counts_.clear();
    allocations_ = 0;
    return cost;
  }

 private:
  static constexpr std::size_t kSwept = 6 << 20;  // bytes; more than a core's second cache has
  static constexpr std::size_t kLine = 64;        // bytes

  void forget() {
    for (std::size_t i = 0; i < swept_.size(); i += kLine) ++swept_[i];
  }

  double at(std::vector<std::uint64_t>& counts, double quantile) const {
    const auto k = static_cast<std::ptrdiff_t>(quantile * static_cast<double>(counts.size() - 1));
    std::nth_element(counts.begin(), counts.begin() + k, counts.end());
    return static_cast<double>(counts[static_cast<std::size_t>(k)]) * ns_;
  }

  double ns_, empty_ns_ = 0;
  std::vector<std::uint64_t> counts_;
  std::size_t allocations_ = 0;
  bool cold_ = false;
  std::vector<char> swept_ = std::vector<char>(kSwept);
};

/// One row from kTickRounds rounds of the same ticks, each by `measure()`. Other programs and the
/// machine can only make a round slower, so the row has the lowest median and 99th percentile. The
/// maximum is that of all rounds.
template <class Measure>
TickCost least_disturbed(const Measure& measure) {
  TickCost row = measure();
  row.p99_highest_ns = row.p99_ns;
  for (int round = 1; round < kTickRounds; ++round) {
    const TickCost next = measure();
    row.ticks += next.ticks;
    row.allocations += next.allocations;
    row.median_ns = std::min(row.median_ns, next.median_ns);
    row.p99_ns = std::min(row.p99_ns, next.p99_ns);
    row.p99_highest_ns = std::max(row.p99_highest_ns, next.p99_ns);
    row.max_ns = std::max(row.max_ns, next.max_ns);
  }
  return row;
}

// Run time of ticks over an object of many convex parts with a tool of several segments.

inline constexpr std::size_t kUnionCosts = 7;  ///< rows

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

/// The hand circles over the ring, turns and tilts; its height follows the depth of contact.
class RingHand {
 public:
  /// \param round  radius of its path, m
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

/// One object of ten overlapping balls of 30 mm in a ring. A cross on the stylus lies on them and
/// turns, 1 to 2 mm deep, at 0.1 m/s. Rows: several finenesses, 990 more balls out of reach, a
/// single segment, and a single ball.
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
    // The cross lies over the ring's hollow; the plain stylus moves over the tops of the balls.
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

constexpr double kRadius = 0.03;  // m
constexpr double kLength = 0.12;  // m, of the stylus
constexpr double kSpeed = 0.1;    // m/s
constexpr int kWarm = 1000;       // ticks
constexpr double kContactTarget = 100, kFreeTarget = 100, kFirstTarget = 2000,
                 kThousandTarget = 1000;  // ns
// ns, of a closed surface: the 99th percentile in contact up to 81,920 triangles, and above; the
// median at a first contact, and of a cold tick in contact and in free space. Of point and ray.
constexpr std::array<double, 2> kSurface = {1000, 2000}, kFineSurface = {1600, 3300},
                                kSurfaceFirst = {800, 1300}, kColdSurface = {4300, 4800};
constexpr double kColdFree = 1200;
constexpr std::size_t kColdTicks = 100, kColdApproaches = 20;  // in a round: forgetting takes long
constexpr int kHundredThousand = 6;                            // subdivisions: 81,920 triangles

/// A hand over a solid about the origin, at 0.1 m/s. Its heading wanders by 1e-3 rad a tick, and it
/// trembles at 7 Hz with 0.01 g, most people's postural tremor (A normative study of postural
/// tremor of the hand, Arch. Neurol. 39:358-362, 1982). With the point renderer the tip slides;
/// with the ray the contact moves between the tip and 40 mm along the side.
class ScriptedHand {
 public:
  ScriptedHand(const rendering::Renderer& renderer, bool touching)
      : side_contact_(renderer.side_contact()), sign_(touching ? 1 : -1) {}

  /// The next pose. The radius is controlled by the last tick's `depth` (m; 0 in free space), so
  /// that the path follows the surface of any mesh.
  rendering::LineProbe next(double depth) {
    const double turn = kWandering * random_.normal();
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
    const double phase = kTremorRate * tick_ * TickTimer::kTick;
    const Vec3 tremor = kTremor * (std::sin(phase) * normal_ + std::cos(phase) * heading_);
    const Vec3 tip = radius_ * normal_ - along * axis + tremor;
    return {tip, tip + kLength * axis};
  }

 private:
  static constexpr double kWandering = 1e-3;                                    // rad a tick
  static constexpr double kTremorRate = 2 * std::numbers::pi * 7;               // rad/s
  static constexpr double kTremor = 0.01 * 9.81 / (kTremorRate * kTremorRate);  // m: 51 um

  Random random_{1};
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
  double target_ns;        ///< for contact; of a closed surface see target_of()
  bool is_surface = false;
  double radius = kRadius;  ///< m; of a sphere about the origin, around the object
};

/// m; depth of tip or side below the bounding sphere, negative outside.
double depth_below(const Bench& bench, const rendering::LineProbe& probe) {
  Vec3 centre(0);
  double radius = bench.radius;
  if (!bench.is_surface) {
    centre = bench.scene.parts()[0].sphere_centre;
    radius = bench.scene.parts()[0].sphere_radius;
  }
  const Vec3 d = probe.tail - probe.tip;
  const double fraction = std::clamp(glm::dot(centre - probe.tip, d) / glm::dot(d, d), 0.0, 1.0);
  return radius - glm::length(probe.tip + fraction * d - centre);
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
    depth = depth_below(bench, probe);
  }
  return timer.take();
}

/// Approaches from 10 mm away in a random direction, drifting along the surface; with the ray every
/// second approach is with the side.
TickCost time_first_contact(TickTimer& timer, const rendering::Renderer& renderer,
                            const Bench& bench, std::size_t approaches) {
  Random random(2);
  const auto any = [&] {
    return glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
  };
  const double radius = bench.is_surface ? bench.radius : bench.scene.parts()[0].sphere_radius;
  // Some approaches miss.
  for (std::size_t i = 0; i < 4 * approaches && timer.ticks() < approaches; ++i) {
    const Vec3 out = any(), level = glm::normalize(glm::cross(out, any()));
    const bool side = i % 2 == 0 && renderer.side_contact();
    const Vec3 axis = side ? level : glm::normalize(out + 0.3 * level);
    const double along = side ? 0.04 : 0;
    const auto probe_at = [&](int t) -> rendering::LineProbe {
      const Vec3 at = (1.2 * radius + 0.01 - t * kSpeed * TickTimer::kTick) * out +
                      0.5 * t * kSpeed * TickTimer::kTick * glm::cross(out, level);
      const Vec3 tip = at - along * axis;
      return {tip, tip + kLength * axis};
    };
    // Once to find it, then again to time that tick.
    constexpr int kMost = 500;
    rendering::RenderState state = bench.scene.initial_state();
    int first = 0;
    while (first < kMost &&
           renderer.tick(bench.scene, state, probe_at(first), TickTimer::kTick).contacts == 0)
      ++first;
    if (first == kMost) continue;
    state = bench.scene.initial_state();
    for (int t = 0; t < first; ++t)
      renderer.tick(bench.scene, state, probe_at(t), TickTimer::kTick);
    timer.tick(renderer, bench.scene, state, probe_at(first), true);
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
    const int k = (i + 555) % 1000;  // put the first in the middle
    object.pose.position = 0.3 * Vec3(k % 10 - 5, k / 10 % 10 - 5, k / 100 - 5);
    objects.push_back(std::move(object));
  }
  return rendering::Scene(std::move(objects));
}

/// A ball with bumps and hollows of up to a tenth of its radius: three tenths of its edges are
/// concave.
Bench bumpy_ball(int subdivisions) {
  stimuli::PolygonSoup soup = stimuli::icosphere(kRadius, subdivisions);
  Random random(3);
  struct Wave {
    Vec3 along;
    double phase;
  };
  std::vector<Wave> waves(6);
  for (Wave& wave : waves)
    wave = {5.0 * Vec3(random.normal(), random.normal(), random.normal()), 6 * random.unit()};
  double radius = 0;
  for (Vec3& v : soup.vertices) {
    const Vec3 out = glm::normalize(v);
    double sum = 0;
    for (const Wave& wave : waves) sum += std::sin(glm::dot(wave.along, out) + wave.phase);
    v *= 1 + 0.1 * sum / static_cast<double>(waves.size());
    radius = std::max(radius, glm::length(v));
  }
  std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, stimuli::Material{}}};
  const auto surface = std::make_shared<const stimuli::Surface>(shells);
  return {"bumpy ball, concave",
          soup.faces.size(),
          rendering::Scene({}, true, {}, nullptr, {{surface, Pose{}, 0}}),
          0,
          true,
          radius};
}

std::vector<Bench> benches(bool with_million) {
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
  for (const int subdivisions : {3, kHundredThousand, 8}) {
    if (subdivisions <= kHundredThousand || with_million) all.push_back(bumpy_ball(subdivisions));
  }
  return all;
}

/// ns
double target_of(const Bench& bench, bool sides, const std::string& state, bool cold) {
  const std::size_t which = sides ? 1 : 0;
  if (!bench.is_surface) {
    if (state == "first_contact") return kFirstTarget;
    return state == "free" ? std::max(kFreeTarget, bench.target_ns) : bench.target_ns;
  }
  if (cold) return state == "free" ? kColdFree : kColdSurface[which];
  if (state == "first_contact") return kSurfaceFirst[which];
  return (bench.triangles > 100'000 ? kFineSurface : kSurface)[which];
}

// Soft bodies. A tick waits for a step of the body here; at a device another thread makes the
// steps.

constexpr int kSoftResolutions[] = {4, 6, 8};  // elements along an edge
constexpr std::size_t kSoftCosts = 2 * std::size(kSoftResolutions);
constexpr std::size_t kSoftTicks = 2000;  // in a round: a step takes up to a millisecond

/// A hand over a soft cube.
TickCost time_soft_contact(TickTimer& timer, const rendering::Scene& scene, std::size_t ticks) {
  const rendering::Renderer& renderer = rendering::ray_renderer();
  rendering::RenderState state = scene.initial_state();
  ScriptedHand hand(renderer, true);
  double depth = 0;
  for (int i = 0; i < kWarm; ++i)
    depth = renderer.tick(scene, state, hand.next(depth), TickTimer::kTick).deepest.depth;
  for (std::size_t i = 0; i < 4 * ticks && timer.ticks() < ticks; ++i)
    depth = timer.tick(renderer, scene, state, hand.next(depth), true).deepest.depth;
  return timer.take();
}

/// Steps of the body alone, under the force of a finger that moves.
TickCost time_soft_steps(const rendering::SoftBody& body, std::size_t steps, double ns,
                         double empty_ns) {
  rendering::SoftState state = body.rest();
  std::vector<double> times;
  times.reserve(steps);
  const auto top = static_cast<std::uint32_t>(body.surface_nodes().size() - 1);
  TickCost cost;
  for (std::size_t i = 0; i < steps; ++i) {
    const rendering::NodeForce force{top,
                                     Vec3(0.1 * std::sin(0.05 * static_cast<double>(i)), 0, -0.3)};
    const std::uint64_t allocated = evidence::allocations();
    const std::uint64_t start = evidence::begin_count();
    body.step(state, {&force, 1});
    times.push_back(static_cast<double>(evidence::end_count() - start) * ns);
    cost.allocations += evidence::allocations() - allocated;
  }
  std::sort(times.begin(), times.end());
  cost.ticks = times.size();
  cost.median_ns = times[times.size() / 2];
  cost.p99_ns = times[times.size() * 99 / 100];
  cost.max_ns = times.back();
  cost.empty_loop_ns = empty_ns;
  return cost;
}

/// Cubes of 60 mm and 20 kPa: ticks in contact, and steps.
void measure_soft_costs(TickTimer& timer, std::size_t ticks, double empty_ns,
                        const std::function<void(TickCost)>& keep) {
  const double ns = evidence::nanoseconds_per_count();
  for (const int resolution : kSoftResolutions) {
    stimuli::ObjectSpec cube;
    cube.shape = stimuli::ShapeKind::cube;
    cube.edge = 2 * kRadius;
    cube.soft = stimuli::Soft{.resolution = resolution};
    SceneBuilder builder;
    const rendering::Scene scene = builder.build({cube}, true);
    const auto& body = *rendering::soft_objects(scene).front()->body;
    const auto named = [&](TickCost cost, const char* state) {
      cost.mesh = "soft cube";
      cost.triangles = body.surface().size();
      cost.elements = body.mesh().hexahedra.size();
      cost.renderer = "ray";
      cost.state = state;
      keep(std::move(cost));
    };
    const std::size_t each = std::min(ticks / kTickRounds, kSoftTicks);
    named(least_disturbed([&] { return time_soft_contact(timer, scene, each); }), "contact");
    named(least_disturbed([&] { return time_soft_steps(body, each / 4, ns, empty_ns); }),
          "soft_step");
  }
}

inline constexpr std::size_t kEffectCosts = 10;  ///< rows

/// The tip slides to and fro over a plate, 0.6 to 1 mm deep, at 0.1 m/s; the stylus leans by 30
/// degrees.
TickCost time_plate(TickTimer& timer, const rendering::Renderer& renderer,
                    const rendering::Scene& scene, std::size_t ticks) {
  constexpr double kTop = 0.01, kReach = 0.02;    // m
  constexpr double kCycle = 4 * kReach / kSpeed;  // s, to and fro
  rendering::RenderState state = scene.initial_state();
  const Vec3 axis = glm::normalize(Vec3(0.5, 0.1, 0.87));
  const auto probe = [&](std::size_t i) {
    const double time = static_cast<double>(i) * TickTimer::kTick;
    const double share = time / kCycle - std::floor(time / kCycle);
    const double x = kReach * (std::abs(4 * share - 2) - 1);
    const double depth = 0.0008 + 0.0002 * std::sin(2 * std::numbers::pi * time / 0.7);
    const Vec3 tip(x, 0.3 * x, kTop - depth);
    return rendering::LineProbe{tip, tip + kLength * axis};
  };
  const rendering::LineProbe first = probe(0);
  const Vec3 above(0, 0, 0.01);
  renderer.tick(scene, state, {first.tip + above, first.tail + above}, TickTimer::kTick);
  for (std::size_t i = 0; i < kWarm; ++i) renderer.tick(scene, state, probe(i), TickTimer::kTick);
  for (std::size_t i = 0; i < ticks; ++i)
    timer.tick(renderer, scene, state, probe(kWarm + i), true);
  return timer.take();
}

/// A smooth plate, and the same with a texture by a formula, one by a table, a field and a knock.
/// The targets are what they may cost beside the smooth one.
void measure_effect_costs(TickTimer& timer, std::size_t ticks,
                          const std::function<void(TickCost)>& keep) {
  stimuli::ObjectSpec plate;
  plate.shape = stimuli::ShapeKind::box;
  plate.size = {0.1, 0.1, 0.02};
  struct Row {
    const char* name;
    double more;  ///< ns
    stimuli::ObjectSpec object;
  };
  std::array<Row, kEffectCosts / 2> rows{{{"plate", 0, plate},
                                          {"plate, sine", 60, plate},
                                          {"plate, noise", 100, plate},
                                          {"plate, curl field", 15, plate},
                                          {"plate, knock", 15, plate}}};
  stimuli::TextureSpec texture;
  texture.period = 0.002;
  texture.depth = 0.0003;
  rows[1].object.texture = texture;
  texture.kind = stimuli::TextureSpec::Kind::noise;
  texture.depth = 0.0002;
  rows[2].object.texture = texture;
  stimuli::FieldSpec curl;
  curl.kind = stimuli::FieldSpec::Kind::curl;
  curl.damping = Mat3(10);
  rows[3].object.fields = {curl};
  rows[4].object.transient.emplace();
  for (const rendering::Renderer* renderer :
       {&rendering::point_renderer(), &rendering::ray_renderer()}) {
    double smooth = 0;
    for (const Row& row : rows) {
      SceneBuilder builder;
      const rendering::Scene scene = builder.build({row.object}, renderer->side_contact());
      TickCost cost =
          least_disturbed([&] { return time_plate(timer, *renderer, scene, ticks / kTickRounds); });
      if (row.more == 0) smooth = cost.net_ns();
      cost.mesh = row.name;
      cost.triangles = 12;
      cost.renderer = renderer->name();
      cost.state = "contact";
      cost.target_ns = row.more == 0 ? kContactTarget : smooth + row.more;
      keep(std::move(cost));
    }
  }
}

}  // namespace

std::vector<TickCost> measure_tick_costs(
    const TickCostSettings& settings, const std::function<void(std::size_t, std::size_t)>& done) {
  TickTimer timer;
  const std::vector<Bench> all = benches(settings.with_million);
  std::vector<TickCost> rows;
  for (const Bench& bench : all) {
    for (const rendering::Renderer* renderer :
         {&rendering::point_renderer(), &rendering::ray_renderer()}) {
      const auto keep = [&](TickCost cost, const char* state) {
        cost.mesh = bench.name;
        cost.triangles = bench.triangles;
        cost.renderer = renderer->name();
        cost.state = state;
        cost.target_ns = target_of(bench, renderer->side_contact(), state, cost.cold);
        cost.target_is_p99 = bench.is_surface && cost.state != "first_contact" && !cost.cold;
        rows.push_back(std::move(cost));
        if (done) done(rows.size(), 12 * all.size() + kUnionCosts + kSoftCosts + kEffectCosts);
      };
      for (const bool cold : {false, true}) {
        timer.set_cold(cold);
        const std::size_t each = settings.ticks / kTickRounds;
        const std::size_t ticks = cold ? std::min(each, kColdTicks) : each;
        const std::size_t approaches =
            cold ? std::min(settings.approaches, kColdApproaches) : settings.approaches;
        keep(least_disturbed([&] { return time_contact(timer, *renderer, bench, ticks); }),
             "contact");
        keep(least_disturbed([&] { return time_free_space(timer, *renderer, bench, ticks); }),
             "free");
        keep(least_disturbed(
                 [&] { return time_first_contact(timer, *renderer, bench, approaches); }),
             "first_contact");
      }
      timer.set_cold(false);
    }
  }
  measure_union_costs(timer, settings.ticks, [&](TickCost cost) {
    rows.push_back(std::move(cost));
    if (done) done(rows.size(), 12 * all.size() + kUnionCosts + kSoftCosts + kEffectCosts);
  });
  measure_effect_costs(timer, settings.ticks, [&](TickCost cost) {
    rows.push_back(std::move(cost));
    if (done) done(rows.size(), 12 * all.size() + kUnionCosts + kSoftCosts + kEffectCosts);
  });
  const double empty_ns = rows.front().empty_loop_ns;
  measure_soft_costs(timer, settings.ticks, empty_ns, [&](TickCost cost) {
    rows.push_back(std::move(cost));
    if (done) done(rows.size(), 12 * all.size() + kUnionCosts + kSoftCosts + kEffectCosts);
  });
  return rows;
}

}  // namespace palpate::runner::evidence
