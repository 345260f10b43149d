// palpate bench: run time of the renderers' ticks on this machine.

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/renderer.h"
#include "runner/commands/shared/command.h"
#include "runner/evidence/tick_meters.h"
#include "runner/output/outputs.h"
#include "runner/scene_builder.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::commands {
namespace {

// Measures the run time of a renderer's tick on this machine.

constexpr int kTickRounds = 5;

/// One row: a scene, a renderer and a state of contact. Every tick is timed separately, in
/// kTickRounds rounds of the same path; all values include `empty_loop_ns`, the cost of reading the
/// time.
struct TickCost {
  std::string mesh;
  std::size_t triangles = 0;         ///< of one object
  std::string renderer;              ///< point or ray
  std::string state;                 ///< contact, free (1 to 2 mm off the object), first_contact
  bool cold = false;                 ///< before each tick, the near caches forgot the last one
  std::size_t ticks = 0;             ///< ticks timed, all in that state
  double median_ns = 0, p99_ns = 0;  ///< each from the round in which it is lowest
  double p99_highest_ns = 0;         ///< from the round in which it is highest
  double max_ns = 0;                 ///< of all rounds
  std::size_t allocations = 0;       ///< on the heap, in all timed ticks
  double empty_loop_ns = 0;
  double target_ns = 0;  ///< design target for the judged value; 0: none
  bool target_is_p99 = false;
  std::size_t parts = 1, near_parts = 1;  ///< convex parts; near_parts: within the tool's reach
  std::size_t segments = 1;               ///< of the tool
  std::size_t elements = 0;               ///< of a soft body; 0: it is rigid

  double net_ns() const { return median_ns - empty_loop_ns; }
  /// Without the empty tick: the median, or the 99th percentile if the target is for that.
  double judged_ns() const { return (target_is_p99 ? p99_ns : median_ns) - empty_loop_ns; }
};

struct TickCostSettings {
  std::size_t ticks = 200'000;    ///< ticks of a row, in all its rounds
  std::size_t approaches = 1000;  ///< first contacts in a round, each in a new trial
  bool with_million = true;       ///< a mesh of 1,310,720 triangles, which takes seconds to make
};

// Times ticks one by one.

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
  bool is_cold() const { return cold_; }

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
  std::vector<rendering::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, stimuli::Material{}}};
  const auto surface = std::make_shared<const rendering::Surface>(shells);
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
  rows[1].object.texture = {.period = 0.002, .depth = 0.0003};
  rows[2].object.texture = {
      .kind = stimuli::TextureSpec::Kind::noise, .period = 0.002, .depth = 0.0002};
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

/// A path at 0.1 m/s over icospheres of 30 mm radius (20 to 327,680 triangles), the paper's other
/// three shapes, one of 1,000 spheres, concave balls (1,280 to 1,310,720 triangles), and
/// objects of ten near spheres with a tool of three segments, and plates with textures, fields and
/// knocks. Penetration depth 1 to 2 mm; the
/// ray's contact moves between the tip and the side. 1,000 ticks precede each row, except for first
/// contacts, which start a new trial 10 mm away, from a random direction. Each row warm, and cold:
/// fewer ticks, and before each the near caches are cleared. \param done  called after each
/// row with the number of rows so far and in total
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

namespace po = boost::program_options;

constexpr std::size_t kTicksForMillion = 20'000;

std::string table(const std::vector<TickCost>& rows) {
  std::string out;
  char line[200];
  std::snprintf(line, sizeof line, "%-24s%10s  %-7s%-20s%8s%8s%8s%9s%7s%8s\n", "mesh", "triangles",
                "probe", "state", "median", "p99", "max us", "net", "target", "allocs");
  out += line;
  for (const TickCost& r : rows) {
    const std::string state = r.state + (r.cold ? ", cold" : "");
    if (r.ticks == 0) {
      std::snprintf(line, sizeof line, "%-24s%10zu  %-7s%-20s did not occur\n", r.mesh.c_str(),
                    r.triangles, r.renderer.c_str(), state.c_str());
    } else {
      std::snprintf(line, sizeof line, "%-24s%10zu  %-7s%-20s%8.0f%8.0f%8.1f%9.0f%7.0f%8zu%s\n",
                    r.mesh.c_str(), r.triangles, r.renderer.c_str(), state.c_str(), r.median_ns,
                    r.p99_ns, r.max_ns / 1000, r.net_ns(), r.target_ns, r.allocations,
                    r.target_ns > 0 && r.judged_ns() > r.target_ns ? "  over" : "");
    }
    out += line;
  }
  return out;
}

const TickCost* find(const std::vector<TickCost>& rows, std::size_t triangles,
                     const char* renderer) {
  for (const TickCost& r : rows) {
    if (r.mesh == "icosphere" && r.triangles == triangles && r.renderer == renderer &&
        r.state == "contact" && !r.cold) {
      return &r;
    }
  }
  return nullptr;
}

const TickCost* find_union(const std::vector<TickCost>& rows, std::size_t triangles,
                           std::size_t parts) {
  for (const TickCost& r : rows) {
    if (r.target_is_p99 && r.near_parts == 10 && r.segments == 3 && r.triangles == triangles &&
        r.parts == parts && r.ticks > 0) {
      return &r;
    }
  }
  return nullptr;
}

/// Ten near parts and three segments: the cost, and its growth.
std::string growth_of_unions(const std::vector<TickCost>& rows) {
  const TickCost* const ten = find_union(rows, 1280, 10);
  const TickCost* const many = find_union(rows, 1280, 1000);
  const TickCost* const fine = find_union(rows, 327680, 10);
  if (ten == nullptr || many == nullptr || fine == nullptr) return "";
  char text[300];
  std::snprintf(text, sizeof text,
                "Ten near parts and a tool of three segments: median %.2f us, p99 %.2f us; %.2fx "
                "with 990 parts more out of reach, %.2fx with 327,680 triangles a part (medians "
                "without the empty tick).\n",
                ten->median_ns / 1000, ten->p99_ns / 1000, many->net_ns() / ten->net_ns(),
                fine->net_ns() / ten->net_ns());
  return text;
}

/// The meaning of the numbers for a lab.
std::string conclusions(const std::vector<TickCost>& rows) {
  std::string out;
  char text[300];
  for (const char* renderer : {"point", "ray"}) {
    const TickCost* const small = find(rows, 1280, renderer);
    const TickCost* const large = find(rows, 327680, renderer);
    if (small == nullptr || large == nullptr) continue;
    std::snprintf(text, sizeof text,
                  "Growth from 1,280 to 327,680 triangles in contact, %s: %.2fx as read, %.2fx "
                  "without the empty tick.\n",
                  renderer, large->median_ns / small->median_ns, large->net_ns() / small->net_ns());
    out += text;
  }
  out += growth_of_unions(rows);
  double p99 = 0;
  for (const TickCost& r : rows) {
    if (!r.cold && r.elements == 0) p99 = std::max(p99, r.p99_highest_ns);
  }
  const double percent = p99 / 100'000 * 100;
  std::snprintf(text, sizeof text,
                "99 %% of ticks in every warm row and round (but soft bodies) take less than %.1f "
                "us: %.1f %% of a "
                "period at 10 "
                "kHz, %.2f %% at 1 kHz. Rendering is %s on this computer; for the timing of the "
                "servo see palpate devices --timing.\n",
                p99 / 1000, percent, percent / 10,
                percent < 20    ? "fit for 1 to 10 kHz"
                : percent < 200 ? "fit for 1 kHz, not for 10 kHz"
                                : "too slow for 1 kHz");
  return out + text;
}

nlohmann::ordered_json to_json(const std::vector<TickCost>& rows) {
  auto list = nlohmann::ordered_json::array();
  for (const TickCost& r : rows) {
    nlohmann::ordered_json row = {
        {"mesh", r.mesh},   {"triangles", r.triangles},           {"renderer", r.renderer},
        {"state", r.state}, {"caches", r.cold ? "cold" : "warm"}, {"ticks", r.ticks}};
    const auto number = [&](const char* key, double ns) {
      row[key] = r.ticks > 0 ? nlohmann::ordered_json(ns) : nlohmann::ordered_json(nullptr);
    };
    number("median_ns", r.median_ns);
    number("p99_ns", r.p99_ns);
    number("p99_highest_ns", r.p99_highest_ns);
    number("max_ns", r.max_ns);
    row["allocations"] = r.allocations;
    row["empty_loop_ns"] = r.empty_loop_ns;
    row["target_ns"] = r.target_ns > 0 ? nlohmann::ordered_json(r.target_ns) : nullptr;
    row["target_of"] = r.target_is_p99 ? "p99" : "median";
    row["parts"] = r.parts;
    row["near_parts"] = r.near_parts;
    row["tool_segments"] = r.segments;
    if (r.elements > 0) row["elements"] = r.elements;
    list.push_back(std::move(row));
  }
  return {{"program_version", PALPATE_VERSION}, {"build", PALPATE_BUILD}, {"rows", list}};
}

}  // namespace

int bench_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate bench [--json FILE [--force]] [--ticks N]";
  line.summary =
      "Measures the run time of the renderers' ticks on this machine, each tick separately,\n"
      "in nanoseconds, in five rounds of the same ticks. The lowest median and the lowest 99th\n"
      "percentile are kept, to leave out the load of other programs. Quit them nevertheless:\n"
      "they slow down all rounds.";
  line.example =
      "  palpate bench                       a table, about a minute\n"
      "  palpate bench --json bench.json     the same for programs\n";
  line.options.add_options()                                                               //
      ("json", po::value<std::string>()->value_name("FILE"), "write the numbers as JSON")  //
      ("ticks", po::value<long>()->default_value(200'000)->value_name("N"),
       "ticks a row, 1000 to 100 million; below 20000 without the mesh of a million triangles")  //
      ("force", "replace an existing file");
  const auto values = line.parse(args);
  if (!values) return 0;
  output::Outputs outputs(*values, {"json"}, {});
  const long ticks = (*values)["ticks"].as<long>();
  if (ticks < 1000 || ticks > 100'000'000)
    throw UsageError("--ticks: must be 1000 to 100000000, not " + std::to_string(ticks));
  TickCostSettings settings;
  settings.ticks = static_cast<std::size_t>(ticks);
  settings.with_million = settings.ticks >= kTicksForMillion;
  settings.approaches = std::max<std::size_t>(50, settings.ticks / 200);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto rows = measure_tick_costs(settings, [&](std::size_t so_far, std::size_t all) {
    if (terminal)
      std::fprintf(stderr, "\r%zu of %zu rows%s", so_far, all, so_far == all ? "\n" : "");
  });
  std::cout
      << "A tick, ns (max: us). An empty tick takes " << rows[0].empty_loop_ns
      << ", which is subtracted in the net median. The lowest median and the lowest p99 of "
      << kTickRounds
      << " rounds of the same ticks;\nthe maximum is mostly due to the operating system.\n"
         "Stylus at 0.1 m/s, with a hand's tremor; contact 1 to 2 mm deep; free: 1 to 2 mm off the "
         "bounding sphere; first_contact: in a new trial each. cold: the near caches are cleared "
         "before each tick. Where a tool or a concave mesh is named, the target of contact and "
         "free "
         "is that of p99, of a cold row that of the median.\n\n"
      << table(rows) << "\n"
      << conclusions(rows);
  outputs.put("json", to_json(rows).dump(2) + "\n");
  outputs.write();
  return 0;
}

}  // namespace palpate::runner::commands
