#include "runner/evidence/verification/extreme_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "runner/evidence/verification/random_solids.h"
#include "runner/evidence/verification/reference.h"
#include "runner/evidence/verification/search.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence::extremes {

// Shared by the extreme cases: a scene whose every tick is audited.

using MeshPointer = std::shared_ptr<const stimuli::ConvexMesh>;

inline MeshPointer solid(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

inline constexpr double kStylus = 0.12;  // m
inline constexpr double kRounding =
    1e-9;  // of the object's size; smaller errors of lengths are rounding
inline constexpr const char* kLengthError = "worst error of a length, sizes of the object";

/// One object under a renderer, every tick compared with the reference.
class AuditedScene {
 public:
  AuditedScene(const rendering::Renderer& renderer, MeshPointer mesh, const Pose& pose = {})
      : renderer_(renderer),
        mesh_(std::move(mesh)),
        pose_(pose),
        scene_({{mesh_, pose, stimuli::Material{}, 0, nullptr}}, renderer.side_contact()),
        state_(scene_.initial_state()) {}

  const stimuli::ConvexMesh& mesh() const { return *mesh_; }
  const rendering::Renderer& renderer() const { return renderer_; }

  rendering::LineProbe to_world(const rendering::LineProbe& p) const {
    return {pose_.orientation * p.tip + pose_.position,
            pose_.orientation * p.tail + pose_.position};
  }

  rendering::Rendering tick(const rendering::LineProbe& world) {
    return renderer_.tick(scene_, state_, world, 1e-3);
  }

  /// A tick that must be right; probe in the object's frame.
  rendering::Rendering audited_tick(const rendering::LineProbe& local) {
    const rendering::LineProbe world = to_world(local);
    rendering::Rendering r = tick(world);
    const TickAudit audit = audit_tick(scene_, renderer_, world, r, kRounding);
    ++result_.ticks;
    result_.in_contact += r.contacts > 0;
    // Do not count the rounding that distance from the origin and a long probe add.
    const double rounding = audit.tolerance - kRounding * mesh_->size();
    const double error = std::max({audit.missed, audit.penetrates, audit.floats, audit.shallow});
    result_.worst = std::max(result_.worst, std::max(0.0, error - rounding) / mesh_->size());
    if ((!audit.good() || r.faults != 0) && result_.detail.empty()) {
      std::ostringstream out;
      out << renderer_.name() << ", tick " << result_.ticks << ": missed " << audit.missed
          << " m, penetrates " << audit.penetrates << " m, floats " << audit.floats
          << " m, too shallow by " << audit.shallow << " m, relative error of force " << audit.force
          << ", fault bits " << r.faults << (audit.finite ? "" : ", not finite") << "; size "
          << mesh_->size() << " m";
      result_.detail = out.str();
    }
    return r;
  }

  void fail(const std::string& what) {
    if (result_.detail.empty()) result_.detail = what;
  }

  /// Errors of lengths so far.
  ExtremeResult result() const {
    ExtremeResult result = result_;
    result.limit = kRounding;
    result.passed = result.detail.empty();
    return result;
  }

 private:
  const rendering::Renderer& renderer_;
  MeshPointer mesh_;
  Pose pose_;
  rendering::Scene scene_;
  rendering::RenderState state_;
  ExtremeResult result_;
};

/// The worst of several results.
class CombinedResult {
 public:
  void add(const ExtremeResult& one) {
    all_.worst = std::max(all_.worst, one.worst);
    all_.limit = one.limit;
    all_.ticks += one.ticks;
    all_.in_contact += one.in_contact;
    if (!one.passed && all_.detail.empty()) all_.detail = one.detail;
  }
  /// A case without any contact proves nothing.
  ExtremeResult result() const {
    ExtremeResult all = all_;
    if (all.in_contact == 0) all.detail = "nothing was touched";
    all.passed = all.detail.empty();
    return all;
  }

 private:
  ExtremeResult all_;
};

/// Paths of all kinds over one object, with probes of these lengths (m).
ExtremeResult paths_over(const rendering::Renderer& renderer, const MeshPointer& mesh,
                         const Pose& pose, const std::vector<double>& lengths, std::size_t ticks);

// By shape.
ExtremeResult sliver(const rendering::Renderer& renderer);
ExtremeResult needle(const rendering::Renderer& renderer);
ExtremeResult nearly_coplanar(const rendering::Renderer& renderer);
ExtremeResult duplicate_vertices(const rendering::Renderer& renderer);
ExtremeResult small_object(const rendering::Renderer& renderer);
ExtremeResult large_object(const rendering::Renderer& renderer);
ExtremeResult far_object(const rendering::Renderer& renderer);
ExtremeResult million_triangles(const rendering::Renderer& renderer);

// By motion of the hand.
ExtremeResult thin_plate(const rendering::Renderer& renderer);
ExtremeResult parallel_edge(const rendering::Renderer& renderer);
ExtremeResult through_vertices(const rendering::Renderer& renderer);
ExtremeResult zero_length(const rendering::Renderer& renderer);
ExtremeResult tiny_length(const rendering::Renderer& renderer);
ExtremeResult starts_inside(const rendering::Renderer& renderer);
ExtremeResult teleports(const rendering::Renderer& renderer);
ExtremeResult bad_poses(const rendering::Renderer& renderer);

// By energy over a closed path.
ExtremeResult closed_paths(const rendering::Renderer& renderer);
ExtremeResult closed_paths_lossy(const rendering::Renderer& renderer);
ExtremeResult closed_paths_in_the_blend(const rendering::Renderer& renderer);

// Extreme cases by energy: the work of the renderer on the hand over closed paths. A virtual wall
// must be passive: it returns at most the energy put in.

namespace {

constexpr double kBlend = std::numbers::pi / 180;  // rad; equation (2)
constexpr double kExtrapolated = 1e-6;  // of the stored energy; error of the extrapolation
constexpr double kDepth = 1e-3;         // m, the middle of a cycle

/// tip = middle + across sin(turn) + along (1 - cos(turn)), and the tail likewise; periodic.
struct Cycle {
  rendering::LineProbe middle, across, along;

  rendering::LineProbe at(double turn) const {
    return sum(middle, std::sin(turn), 1 - std::cos(turn));
  }
  rendering::LineProbe rate(double turn) const { return sum({}, std::cos(turn), std::sin(turn)); }

 private:
  rendering::LineProbe sum(const rendering::LineProbe& from, double a, double b) const {
    return {from.tip + a * across.tip + b * along.tip,
            from.tail + a * across.tail + b * along.tail};
  }
};

struct Lap {
  double work = 0;      ///< J, done on the hand
  double wound_up = 0;  ///< J, growth of the friction spring's energy
  double stored = 0;    ///< J, at the deepest
  double force = 0;     ///< N, the largest
  double rocking = 0;   ///< m, travel of one end against the other along z in the blend of (2)
  double jumps = 0;     ///< J, error bound of the sum where the force jumps between facets
  int ticks = 0, in_contact = 0, in_blend = 0;
  bool one_facet = true;  ///< held by one facet of M all the way
  bool upwards = true;    ///< its normal within some degrees of +z
};

/// One object, its material, and a hand on closed paths.
class ClosedPathBench {
 public:
  ClosedPathBench(const rendering::Renderer& renderer,
                  const std::shared_ptr<const stimuli::ConvexMesh>& mesh,
                  const stimuli::Material& material)
      : renderer_(renderer),
        stiffness_(material.stiffness),
        scene_({{mesh, {}, material, 0, nullptr}}, renderer.side_contact()),
        state_(scene_.initial_state()) {}

  rendering::Rendering tick(const rendering::LineProbe& probe) {
    return renderer_.tick(scene_, state_, probe, 1e-3);
  }

  /// Straight in along `motion` (unit) until it is kDepth deep; returns the pose there.
  /// \param probe  at the object's middle
  rendering::LineProbe press(const rendering::LineProbe& probe, const Vec3& motion, double from) {
    constexpr double kStep = 1e-4;
    rendering::LineProbe now = probe;
    for (double left = from; left > -from; left -= kStep) {
      now = {probe.tip - left * motion, probe.tail - left * motion};
      if (tick(now).deepest.depth > kDepth) break;
    }
    return now;
  }

  /// One lap, continuing from the last tick. Over a period, the sum of force times speed at equal
  /// steps converges faster than any power of their number if the force is smooth. If the lap is
  /// not periodic (friction drifts), its ends are weighted as in the trapezium rule.
  Lap lap(const Cycle& cycle, int ticks) {
    Lap lap;
    const double step = 2 * std::numbers::pi / ticks, power_before = power_;
    const double friction_before = friction_energy();
    const rendering::ContactFeature first = state_.parts[0].feature;
    lap.one_facet = first.kind != rendering::ContactFeature::Kind::none;
    for (int i = 1; i <= ticks; ++i) {
      const rendering::LineProbe probe = cycle.at(i * step), rate = cycle.rate(i * step);
      const rendering::ContactFeature last = state_.parts[0].feature;
      const rendering::Rendering r = tick(probe);
      const rendering::ContactFeature facet = state_.parts[0].feature;
      power_ = glm::dot(r.device1, rate.tip) + glm::dot(r.device2, rate.tail);
      lap.work += power_ * step;
      const bool blends = r.deepest.type == rendering::ContactType::segment_face;
      if (blends) lap.rocking += std::abs(rate.tail.z - rate.tip.z) * step;
      if (!(facet == last)) {
        lap.jumps += glm::length(r.force) * (glm::length(rate.tip) + glm::length(rate.tail)) * step;
      }
      lap.one_facet &= facet.kind == first.kind && facet.index == first.index;
      lap.upwards &=
          facet.kind != rendering::ContactFeature::Kind::none && !(r.deepest.normal.z < 0.99);
      lap.stored = std::max(lap.stored, stiffness_ * r.deepest.depth * r.deepest.depth / 2);
      lap.force = std::max(lap.force, glm::length(r.force));
      ++lap.ticks;
      lap.in_contact += r.contacts > 0;
      lap.in_blend += blends;
    }
    lap.work += (power_before - power_) * step / 2;
    lap.wound_up = friction_energy() - friction_before;
    return lap;
  }

 private:
  /// J, of the spring that holds a sticking contact.
  double friction_energy() const {
    const Vec3& offset = state_.parts[0].friction.tangential_offset;
    return stiffness_ * glm::dot(offset, offset) / 2;
  }

  const rendering::Renderer& renderer_;
  double stiffness_;
  rendering::Scene scene_;
  rendering::RenderState state_;
  double power_ = 0;  ///< J for each radian of the cycle, at the last tick
};

Vec3 direction(Random& random) { return stimuli::uniform_rotation(random) * Vec3(0, 0, 1); }

rendering::LineProbe small(Random& random, double most) {
  return {most * random.unit() * direction(random), most * random.unit() * direction(random)};
}

const std::shared_ptr<const stimuli::ConvexMesh>& shape(std::uint64_t index) {
  static const std::array kShapes = {
      std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(0.03, 2)),
      std::make_shared<const stimuli::ConvexMesh>(stimuli::cone(0.03, 0.06, 32)),
      std::make_shared<const stimuli::ConvexMesh>(stimuli::cylinder(0.03, 0.06, 32)),
      std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06))};
  return kShapes[index % kShapes.size()];
}

/// A stylus in any pose pressed into a shape, on a small closed path.
Cycle cycle_anywhere(Random& random, ClosedPathBench& bench) {
  const Vec3 out = direction(random), d = kStylus * direction(random);
  const double fraction = random.unit();
  Cycle cycle;
  cycle.middle = bench.press({-fraction * d, (1 - fraction) * d}, -out, 0.3);
  cycle.across = small(random, 4e-4);
  cycle.along = small(random, 2e-4);
  return cycle;
}

/// A stylus nearly flat on the top of the cube, rocking through the blend of equation (2).
Cycle cycle_over_a_flat(Random& random, ClosedPathBench& bench) {
  const double turn = 2 * std::numbers::pi * random.unit();
  // The ends of the full length are past the face; those of a short stylus are over it.
  const double length = random.unit() < 0.5 ? kStylus : 0.3 * kStylus;
  const Vec3 d = length * Vec3(std::cos(turn), std::sin(turn), 0);
  const double fraction = random.unit();
  const Vec3 centre(0.02 * random.unit(), 0.02 * random.unit(), 0);
  Cycle cycle;
  cycle.middle = bench.press({centre - fraction * d, centre + (1 - fraction) * d}, {0, 0, -1}, 0.1);
  cycle.across = small(random, 1e-3);
  cycle.along = small(random, 5e-4);
  // The rise of one end over the other at 2 degrees, less the ends' other motion.
  const double rock = 2 * random.unit() * length * std::sin(kBlend);
  cycle.across.tip.z = -0.5 * rock;
  cycle.across.tail.z = 0.5 * rock;
  return cycle;
}

stimuli::Material springy() {
  stimuli::Material material;
  material.stiffness = 800;
  return material;
}

std::string describe(const char* what, std::uint64_t round, const Lap& lap) {
  std::ostringstream out;
  out << "cycle " << round << ": " << what << " " << lap.work << " J (friction's spring "
      << lap.wound_up << " J), stored " << lap.stored << " J at the deepest";
  return out.str();
}

void count(ExtremeResult& result, const Lap& lap) {
  result.ticks += static_cast<std::uint64_t>(lap.ticks);
  result.in_contact += static_cast<std::uint64_t>(lap.in_contact);
}

}  // namespace

ExtremeResult closed_paths(const rendering::Renderer& renderer) {
  CombinedResult all;
  for (std::uint64_t round = 0; round < 400; ++round) {
    Random random(round, {21});
    ClosedPathBench bench(renderer, shape(round), springy());
    const Cycle cycle = cycle_anywhere(random, bench);
    bench.lap(cycle, 400);  // the first begins with a jump
    const Lap lap = bench.lap(cycle, 400);
    if (!lap.one_facet || (renderer.side_contact() && lap.in_blend > 0)) continue;
    ExtremeResult result;
    count(result, lap);
    result.limit = kRounding;
    result.worst = std::abs(lap.work) / lap.stored;
    if (!(result.worst <= result.limit)) result.detail = describe("work", round, lap);
    result.passed = result.detail.empty();
    all.add(result);
  }
  return all.result();
}

namespace {

/// The second lap of a cycle over a material with friction, damping or both.
Lap lossy_lap(const rendering::Renderer& renderer, std::uint64_t round, int ticks) {
  Random random(round, {22});
  stimuli::Material material = springy();
  if (round % 3 != 0) material.damping = 3 * random.unit();
  if (round % 3 != 1) {
    material.friction_static = 0.05 + random.unit();
    material.friction_dynamic = material.friction_static * random.unit();
  }
  ClosedPathBench bench(renderer, shape(round / 3), material);
  const Cycle cycle = cycle_anywhere(random, bench);
  bench.lap(cycle, ticks);  // the first begins with a jump and stretches friction's spring
  return bench.lap(cycle, ticks);
}

}  // namespace

ExtremeResult closed_paths_lossy(const rendering::Renderer& renderer) {
  constexpr int kTicks = 400;
  CombinedResult all;
  for (std::uint64_t round = 0; round < 400; ++round) {
    const Lap coarse = lossy_lap(renderer, round, kTicks);
    const Lap fine = lossy_lap(renderer, round, 2 * kTicks);
    if (!fine.one_facet || (renderer.side_contact() && fine.in_blend > 0)) continue;
    // Richardson extrapolation: half the step, half the error.
    const double given = 2 * (fine.work + fine.wound_up) - (coarse.work + coarse.wound_up);
    ExtremeResult result;
    count(result, fine);
    result.limit = kExtrapolated;
    result.worst = std::max(0.0, given / fine.stored);
    if (!(result.worst <= result.limit)) result.detail = describe("gives", round, fine);
    result.passed = result.detail.empty();
    all.add(result);
  }
  return all.result();
}

ExtremeResult closed_paths_in_the_blend(const rendering::Renderer& renderer) {
  CombinedResult all;
  const auto block = shape(3);
  for (std::uint64_t round = 0; round < 400; ++round) {
    Random random(round, {23});
    ClosedPathBench bench(renderer, block, springy());
    const Cycle cycle = cycle_over_a_flat(random, bench);
    bench.lap(cycle, 4000);  // the first begins with a jump
    const Lap lap = bench.lap(cycle, 4000);
    if (!lap.upwards) continue;
    // Equation (2) applies the force of the deeper end at a point between the ends, so its work is
    // at most the force times the relative motion of the ends.
    const double bound = lap.force * lap.rocking + lap.jumps + kRounding * lap.stored;
    ExtremeResult result;
    count(result, lap);
    result.worst = std::abs(lap.work);
    result.limit = bound;
    if (!(result.worst <= bound)) result.detail = describe("work", round, lap);
    result.passed = result.detail.empty();
    all.add(result);
  }
  return all.result();
}

// Extreme cases by motion of the hand.

namespace {

/// 0, values small enough that rounding may hide them, and slightly larger ones.
constexpr double kTiny[] = {0, 1e-17, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3};

}  // namespace

ExtremeResult thin_plate(const rendering::Renderer& renderer) {
  constexpr double kThickness = 1e-4, kEdge = 0.1, kStep = 0.005;  // m; 5 m/s at 1 kHz
  const MeshPointer plate = solid(stretched(stimuli::cube(kEdge), {1, 1, kThickness / kEdge}));
  CombinedResult all;
  for (std::uint64_t round = 0; round < 2000; ++round) {
    Random random(round, {1});
    AuditedScene scene(renderer, plate);
    const double side = round % 2 ? 1 : -1;
    Vec3 direction = random_direction(random);
    direction.z = side * (std::abs(direction.z) + 0.02);
    const Vec3 start(between(random, -0.02, 0.02), between(random, -0.02, 0.02),
                     side * (kThickness / 2 + between(random, 0.006, 0.011)));
    const rendering::LineProbe probe{start, start + kStylus * glm::normalize(direction)};
    double went_wrong = 0;
    for (int i = 0; i < 8; ++i) {
      const rendering::Rendering r =
          scene.audited_tick(translated(probe, Vec3(0, 0, -side * kStep * i)));
      const double depth = side * (side * kThickness / 2 - (start.z - side * kStep * i));
      const bool held = r.contacts == 1 && r.deepest.normal.z * side > 0.999999 &&
                        std::abs(r.deepest.depth - depth) < 1e-12;
      went_wrong += depth > 0 ? !held : r.contacts != 0;
    }
    ExtremeResult result = scene.result();
    result.worst = went_wrong;
    result.limit = 0;
    if (went_wrong > 0 && result.detail.empty()) {
      result.detail = "round " + std::to_string(round) + ": not held on the side of entry";
    }
    result.passed = result.detail.empty();
    all.add(result);
  }
  return all.result();
}

ExtremeResult parallel_edge(const rendering::Renderer& renderer) {
  const MeshPointer box = solid(stimuli::cube(0.06));
  CombinedResult all;
  Random random(2);
  for (const double tilt : kTiny) {
    for (const double beside : kTiny) {
      for (int round = 0; round < 12; ++round) {
        AuditedScene scene(renderer, box);
        // Approaches the edge at y = z = 0.03 from above or from the corner, then moves around the
        // edge, along it and off its end.
        Vec3 u = Vec3(round % 2 ? 1 : -1, 0, 0) + tilt * random_direction(random);
        u = glm::normalize(u);
        const double back = (round % 3) * 0.06;
        Vec3 at(0.005, 0.03 + beside - 2 * beside * (round % 4 == 0), 0.05);
        scene.audited_tick({at - back * u, at + (kStylus - back) * u});
        const Vec3 motions[] = {{0, 0, -0.001}, {0, 0.001, 0}, {0, -0.001, 0},
                                {0.003, 0, 0},  {0, 0, 0.001}, {0, 0.0005, -0.0005}};
        for (int leg = 0; leg < 60; ++leg) {
          const Vec3 motion = leg < 21 ? motions[0] : motions[random.below(6)];
          at += motion;
          scene.audited_tick({at - back * u, at + (kStylus - back) * u});
        }
        all.add(scene.result());
      }
    }
  }
  return all.result();
}

ExtremeResult through_vertices(const rendering::Renderer& renderer) {
  const MeshPointer shapes[] = {solid(stimuli::cube(0.06)), solid(stimuli::icosphere(0.03, 1)),
                                solid(stimuli::cone(0.03, 0.06, 16))};
  CombinedResult all;
  Random random(4);
  for (const MeshPointer& mesh : shapes) {
    for (const Vec3& vertex : mesh->vertices()) {
      for (const double beside : {0.0, 1e-16, 1e-12, 1e-9}) {
        AuditedScene scene(renderer, mesh);
        const Vec3 out = glm::normalize(vertex), u = random_direction(random);
        const double back = renderer.side_contact() ? kStylus * random.unit() : 0;
        const Vec3 aside = beside * random_direction(random);
        for (const double height : {0.3, 0.001, 1e-9, 0.0, -1e-9, -0.0005, -0.001, -0.0015}) {
          const Vec3 at = vertex + height * out + aside;
          scene.audited_tick({at - back * u, at + (kStylus - back) * u});
        }
        ExtremeResult result = scene.result();
        all.add(result);
      }
    }
  }
  return all.result();
}

ExtremeResult zero_length(const rendering::Renderer& renderer) {
  // A probe without length is a point: the force of the point renderer, and no force on device 2.
  const MeshPointer mesh = solid(stimuli::icosphere(0.03, 2));
  AuditedScene scene(renderer, mesh), point(rendering::point_renderer(), mesh);
  Random random(6);
  double worst = 0;
  for (const rendering::LineProbe& probe :
       random_path(random, PathKind::smooth, *mesh, 0, false, 3000)) {
    const rendering::Rendering r = scene.audited_tick(probe), p = point.audited_tick(probe);
    worst = std::max({worst, glm::length(r.force - p.force), glm::length(r.torque),
                      glm::length(r.device2), glm::length(r.device1 - p.force)});
  }
  ExtremeResult result = scene.result();
  result.worst = worst;
  result.limit = 1e-12;
  result.passed = result.passed && worst <= result.limit;
  if (worst > result.limit && result.detail.empty()) result.detail = "not a point's force";
  return result;
}

ExtremeResult tiny_length(const rendering::Renderer& renderer) {
  // Lengths below the rounding of coordinates exist only near the mesh's origin, so use meshes
  // whose surface passes through it.
  const stimuli::PolygonSoup shapes[] = {stimuli::icosphere(0.03, 1), stimuli::cube(0.06)};
  CombinedResult all;
  for (const stimuli::PolygonSoup& shape : shapes) {
    for (int i = 0; i < 8; ++i) {
      Random random(static_cast<std::uint64_t>(i), {8});
      // The origin is at a corner, or somewhere inside.
      const Vec3 corner = shape.vertices[random.below(shape.vertices.size())];
      const Vec3 to = i < 2 ? -corner : -between(random, 0, 0.9) * corner;
      const MeshPointer mesh = solid(turned_and_moved(shape, Quat(1, 0, 0, 0), 1, to));
      for (const double length : {1e-6, 1e-12, 1e-20, 1e-100, 1e-150, 1e-153, 1e-155, 1e-158,
                                  1e-160, 1e-162, 1e-200, 1e-308, 5e-324}) {
        AuditedScene scene(renderer, mesh);
        const Vec3 u = i % 3 == 0 ? Vec3(1, 0, 0) : random_direction(random);
        const Vec3 out = glm::normalize(corner);
        scene.audited_tick({0.1 * out, 0.1 * out + length * u});
        for (int round = 0; round < 10; ++round) {
          scene.audited_tick({Vec3(0), length * u});
          // From under another facet back to the origin.
          const Vec3 at = 0.02 * random.unit() * random_direction(random);
          scene.audited_tick({at, at + length * u});
        }
        all.add(scene.result());
      }
    }
  }
  return all.result();
}

ExtremeResult starts_inside(const rendering::Renderer& renderer) {
  const MeshPointer mesh = solid(stimuli::cone(0.03, 0.06, 32));
  CombinedResult all;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed, {9});
    AuditedScene scene(renderer, mesh);
    const Vec3 inside = Vec3(0, 0, -0.01) + 0.005 * random.unit() * random_direction(random);
    const Vec3 u = random_direction(random);
    const auto probe = [&](double out) {
      return rendering::LineProbe{inside + out * u, inside + (out + kStylus) * u};
    };
    double forces = 0;
    bool bits = true;
    for (int i = 0; i < 5; ++i) {
      const rendering::Rendering r = scene.tick(probe(0.0005 * i));
      forces += glm::length(r.force) + glm::length(r.torque);
      bits = bits && r.faults == rendering::render_fault::kStartedInside && r.contacts == 0;
    }
    // Left once, and back in: contact.
    bits = bits && scene.audited_tick(probe(0.1)).contacts == 0;
    bits = bits && scene.audited_tick(probe(0.0)).contacts == 1;
    if (!bits)
      scene.fail("seed " + std::to_string(seed) +
                 ": wrong fault bits, or no contact after leaving");
    ExtremeResult result = scene.result();
    result.worst = forces;
    result.limit = 0;
    result.passed = result.passed && forces == 0;
    all.add(result);
  }
  return all.result();
}

ExtremeResult teleports(const rendering::Renderer& renderer) {
  CombinedResult all;
  const MeshPointer shapes[] = {solid(stimuli::cube(0.06)), solid(stimuli::icosphere(0.03, 2)),
                                solid(stimuli::cylinder(0.03, 0.06, 64)),
                                solid(stretched(stimuli::cube(0.1), {1, 1, 1e-3}))};
  for (const MeshPointer& mesh : shapes) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      Random random(seed, {10});
      AuditedScene scene(renderer, mesh);
      scene.audited_tick({Vec3(0, 0, 1), Vec3(0, 0, 1 + kStylus)});
      for (int i = 0; i < 200; ++i) {
        // Near, far, very far; about half of them along the axes.
        const double reach = i % 5 == 0 ? 1e5 : i % 5 == 1 ? 1 : 0.05;
        const Vec3 tip = reach * random.unit() * random_direction(random);
        const Vec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        const Vec3 u = random.below(2) ? axes[random.below(3)] : random_direction(random);
        scene.audited_tick({tip, tip + kStylus * u});
      }
      all.add(scene.result());
    }
  }
  return all.result();
}

ExtremeResult bad_poses(const rendering::Renderer& renderer) {
  // Before contact, in contact and behind a plate: no force and the fault bit; the next valid pose
  // is rendered as if nothing had happened.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const MeshPointer mesh = solid(stretched(stimuli::cube(0.1), {1, 1, 1e-3}));
  AuditedScene scene(renderer, mesh);
  double worst = 0;
  for (const double height : {0.01, -0.0001, -0.01}) {
    for (const double value : {kNaN, kInfinity, -kInfinity, 1e300, -1e20, 1.1e6}) {
      for (int k = 0; k < 6; ++k) {
        scene.audited_tick({Vec3(0.01, 0, 0.02), Vec3(0.01, 0.01, 0.14)});
        const rendering::LineProbe good{Vec3(0.01, 0, height), Vec3(0.01, 0.01, height + kStylus)};
        const rendering::Rendering before = scene.audited_tick(good);
        rendering::LineProbe bad = good;
        (k < 3 ? bad.tip : bad.tail)[k % 3] = value;
        const rendering::Rendering broken = scene.tick(bad);
        worst = std::max({worst, glm::length(broken.force), glm::length(broken.torque),
                          glm::length(broken.device1), glm::length(broken.device2)});
        if (!(broken.faults & rendering::render_fault::kNonFinite)) scene.fail("no fault bit");
        const rendering::Rendering after = scene.audited_tick(good);
        worst = std::max(worst, glm::length(after.force - before.force));
      }
    }
  }
  ExtremeResult result = scene.result();
  result.worst = worst;
  result.limit = 0;
  result.passed = result.passed && worst == 0;
  if (worst > 0 && result.detail.empty()) result.detail = "a force at a bad pose or after it";
  return result;
}

// Extreme cases by shape.

namespace {

constexpr std::size_t kTicks = 300;  // a path

Pose some_pose(const Vec3& position) {
  Random random(3);
  return {position, stimuli::uniform_rotation(random)};
}

/// Every face with corners of its own, each followed by faces without area.
stimuli::PolygonSoup with_duplicates(const stimuli::PolygonSoup& soup) {
  stimuli::PolygonSoup out;
  for (const auto& face : soup.faces) {
    std::vector<std::uint32_t> own;
    for (const std::uint32_t v : face) {
      own.push_back(static_cast<std::uint32_t>(out.vertices.size()));
      out.vertices.push_back(soup.vertices[v]);
      out.vertices.push_back(soup.vertices[v]);
    }
    out.faces.push_back(own);
    out.faces.push_back({own[0], own[0] + 1, own[1]});
    out.faces.push_back({own[0] + 1, own[0], own[1]});
  }
  return out;
}

/// A disc whose upper side is a cone that rises by `angle` (rad) only.
stimuli::PolygonSoup nearly_flat_cone(double angle, int segments) {
  stimuli::PolygonSoup soup = stimuli::cylinder(0.05, 0.02, segments);
  const double top = 0.01;
  stimuli::PolygonSoup out;
  out.vertices = soup.vertices;
  const auto apex = static_cast<std::uint32_t>(out.vertices.size());
  out.vertices.emplace_back(0, 0, top + 0.05 * std::tan(angle));
  for (const auto& face : soup.faces) {
    bool is_top = true;
    for (const std::uint32_t v : face) is_top = is_top && soup.vertices[v].z > 0;
    if (!is_top) {
      out.faces.push_back(face);
      continue;
    }
    for (std::size_t k = 0; k < face.size(); ++k) {
      out.faces.push_back({face[k], face[(k + 1) % face.size()], apex});
    }
  }
  return out;
}

}  // namespace

ExtremeResult paths_over(const rendering::Renderer& renderer, const MeshPointer& mesh,
                         const Pose& pose, const std::vector<double>& lengths, std::size_t ticks) {
  CombinedResult all;
  std::uint64_t stream = 0;
  for (const double length : lengths) {
    for (int kind = 0; kind < kPathKinds; ++kind) {
      Random random(17, {++stream});
      AuditedScene scene(renderer, mesh, pose);
      for (const rendering::LineProbe& probe :
           random_path(random, static_cast<PathKind>(kind), *mesh, length, renderer.side_contact(),
                       ticks)) {
        scene.audited_tick(probe);
      }
      all.add(scene.result());  // one path may miss a needle; all together may not
    }
  }
  return all.result();
}

ExtremeResult sliver(const rendering::Renderer& renderer) {
  // A blade, and a tetrahedron whose every face is a sliver of 1 to 1,000,000.
  const MeshPointer blade = solid(stretched(stimuli::cube(0.1), {1, 1e-6, 1}));
  stimuli::PolygonSoup wedge;
  wedge.vertices = {{-0.05, 0, 0}, {0.05, 0, 0}, {0, -5e-8, 1e-7}, {0, 5e-8, 1e-7}};
  wedge.faces = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  CombinedResult all;
  all.add(paths_over(renderer, blade, {}, {0.1, kStylus, 1e-6}, kTicks));
  all.add(paths_over(renderer, solid(wedge), some_pose({0.1, 0, 0}), {0.1, kStylus}, kTicks));
  return all.result();
}

ExtremeResult needle(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stretched(stimuli::cylinder(0.05, 0.1, 12), {1e-5, 1e-5, 1})),
                    some_pose({0, 0.2, 0}), {0, 0.01, kStylus}, kTicks);
}

ExtremeResult nearly_coplanar(const rendering::Renderer& renderer) {
  CombinedResult all;
  for (const double angle : {1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13}) {
    all.add(paths_over(renderer, solid(nearly_flat_cone(angle, 24)), {}, {kStylus}, kTicks));
  }
  return all.result();
}

ExtremeResult duplicate_vertices(const rendering::Renderer& renderer) {
  const stimuli::PolygonSoup shapes[] = {stimuli::cube(0.06), stimuli::icosphere(0.03, 2),
                                         stimuli::cone(0.03, 0.06, 32)};
  CombinedResult all;
  for (const stimuli::PolygonSoup& soup : shapes) {
    all.add(paths_over(renderer, solid(with_duplicates(soup)), {}, {kStylus}, kTicks));
  }
  return all.result();
}

ExtremeResult small_object(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stimuli::icosphere(5e-5, 2)), some_pose({0.05, 0, 0.02}),
                    {0, 1e-4, kStylus}, kTicks);
}

ExtremeResult large_object(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stimuli::icosphere(50, 3)), {}, {0, kStylus, 300}, kTicks);
}

ExtremeResult far_object(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stimuli::cone(0.03, 0.06, 64)), some_pose({1000, 0, 0}),
                    {0, kStylus}, kTicks);
}

ExtremeResult million_triangles(const rendering::Renderer& renderer) {
  // 1,310,720 triangles with edges of 0.1 mm on average.
  const MeshPointer mesh = solid(stimuli::icosphere(0.0216, 8));
  AuditedScene scene(renderer, mesh);
  Random random(5);
  // The reference scans every triangle, so take few ticks, from free space to sliding at 0.1 m/s.
  const Vec3 axis = stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
  const Vec3 across = glm::normalize(glm::cross(axis, Vec3(1, 0, 0)));
  for (int i = 0; i < 60; ++i) {
    const double turn = 1e-4 * i / 0.0216, depth = i < 2 ? -0.005 : 0.001 * std::sin(0.2 * i);
    const Vec3 out = std::cos(turn) * axis + std::sin(turn) * across;
    const Vec3 direction = glm::normalize(out + (0.5 + 0.05 * i) * across);
    const Vec3 tip = (0.0216 - depth) * out;
    scene.audited_tick({tip, tip + kStylus * direction});
  }
  return scene.result();
}

}  // namespace palpate::runner::evidence::extremes

namespace palpate::runner::evidence {

std::span<const ExtremeCase> extreme_cases() {
  using namespace extremes;
  static constexpr ExtremeCase kCases[] = {
      {"sliver", "faces 1,000,000 times as long as wide, all kinds of paths", kLengthError, sliver},
      {"needle", "0.1 m long, 1 um thick", kLengthError, needle},
      {"thin-plate", "0.1 mm thick, crossed at 5 m/s (5 mm a tick)",
       "ticks not held on the side of entry", thin_plate},
      {"parallel-edge", "probe along an edge, exactly or off by 1e-17 to 1e-3 rad and sizes",
       kLengthError, parallel_edge},
      {"through-vertices", "probe through every corner, exactly or off by 1e-16 to 1e-9 m",
       kLengthError, through_vertices},
      {"zero-length", "a probe without length is a point", "worst difference of force, N",
       zero_length},
      {"tiny-length", "probes of 1e-6 down to 5e-324 m", kLengthError, tiny_length},
      {"million-triangles", "1,310,720 triangles with edges of 0.1 mm", kLengthError,
       million_triangles},
      {"small-object", "a sphere of 0.1 mm", kLengthError, small_object},
      {"large-object", "a sphere of 100 m", kLengthError, large_object},
      {"far-object", "a cone 1 km from the origin", kLengthError, far_object},
      {"duplicate-vertices", "every face with corners of its own, faces without area", kLengthError,
       duplicate_vertices},
      {"nearly-coplanar", "facets that meet at 1e-3 to 1e-13 rad", kLengthError, nearly_coplanar},
      {"starts-inside", "a trial that begins inside: no force until it has been left once",
       "force before that, N", starts_inside},
      {"teleports", "an unrelated pose at every tick, up to 100 km away", kLengthError, teleports},
      {"bad-poses", "NaN, infinities and 1,000 km: no force, the fault bit, recovery",
       "force at or difference after a bad pose, N", bad_poses},
      {"closed-paths", "closed paths on one feature, elastic",
       "worst work of a cycle, as a fraction of the energy stored", closed_paths},
      {"closed-paths-lossy", "the same with friction, with damping, with both",
       "most work on the hand in a cycle, as a fraction of the energy stored", closed_paths_lossy},
      {"closed-paths-blend",
       "a stylus that rocks flat on a face, through the blend of equation (2)",
       "worst work of a cycle, J; allowed: force times rocking", closed_paths_in_the_blend},
  };
  return kCases;
}

}  // namespace palpate::runner::evidence
