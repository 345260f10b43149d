#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "runner/evidence/verification/extremes/audited_scene.h"
#include "runner/evidence/verification/extremes/cases.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/primitives.h"

// Extreme cases by energy: the work of the renderer on the hand over closed paths. A virtual wall
// must be passive: it returns at most the energy put in.

namespace palpate::runner::evidence::extremes {
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

}  // namespace palpate::runner::evidence::extremes
