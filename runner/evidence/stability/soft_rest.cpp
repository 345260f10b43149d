#include "runner/evidence/stability/soft_rest.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/soft/soft_build.h"
#include "rendering/bodies/soft/soft_object.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kSoftHalf = 0.015, kSoftTick = 0.001;  // m, s

constexpr double kModuli[] = {1e3, 1e4, 1e5, 1e6, 1e7};   // Pa
constexpr double kRates[] = {62.5, 125, 250, 500, 1000};  // Hz
constexpr double kSprings[] = {200, 800, 3000};           // N/m
constexpr int kHeldTicks = 1500, kWatchedTicks = 200;
constexpr int kLongestHeldTicks = 12500, kLongWatchedTicks = 1000;  // for undamped bodies

rendering::SoftObject slab(const SoftCase& what) {
  stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.06, 0.06, 2 * kSoftHalf}, {4, 4, 2});
  std::vector<std::uint32_t> held;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (mesh.nodes[i].z < -0.999 * kSoftHalf) held.push_back(i);
  }
  const rendering::SoftSettings settings{
      .material = {.young = what.young, .poisson = what.poisson, .damping = what.damping},
      .step = 1 / what.rate};
  return {std::make_shared<const rendering::SoftBody>(std::move(mesh), held, settings),
          {.radius = what.radius, .stiffness = what.stiffness},
          0};
}

struct WorstSwing {
  double share = 0;
  bool accepted = false, finite = true;
};

WorstSwing worst_of(const std::vector<SoftSwing>& map, double young, double rate) {
  WorstSwing out;
  for (const SoftSwing& one : map) {
    if (one.what.young != young || one.what.rate != rate) continue;
    out.finite = out.finite && one.finite;
    if (!one.accepted) continue;
    out.accepted = true;
    out.share = std::max(out.share, one.swing);
  }
  return out;
}

}  // namespace

SoftSwing press_and_hold(const SoftCase& what) {
  const rendering::SoftObject object = slab(what);
  rendering::SoftObjectState state = rendering::initial_state(object);
  rendering::PlacedTool tool;
  tool.count = 1;
  tool.segments[0] = {Vec3(0), Vec3(0, 0, 0.1)};
  SoftSwing out{.what = what};
  out.accepted = rendering::coupling_is_stable(
      {.young = what.young, .poisson = what.poisson, .damping = what.damping}, what.rate);
  Vec3 at(what.x, what.y, kSoftHalf + what.radius + 0.0005);
  const double goal = kSoftHalf + what.radius - what.depth, fall = what.speed * kSoftTick;
  const auto tick = [&] {
    const double step = std::max(-fall, goal - at.z);
    at.z += step;
    const double force = rendering::advance(object, state, at, tool, std::abs(step), kSoftTick).z;
    out.finite = out.finite && std::isfinite(force);
    return force;
  };
  const auto watch = [&](int ticks) {
    double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0;
    for (int i = 0; i < ticks; ++i) {
      const double force = tick();
      low = std::min(low, force);
      high = std::max(high, force);
      sum += force;
    }
    out.force = sum / ticks;
    out.swing = out.force > 0 ? (high - low) / out.force : std::numeric_limits<double>::infinity();
  };
  const int falling = static_cast<int>((at.z - goal) / fall) + 1;
  int held = kHeldTicks;
  for (int i = 0; i < falling + held - kWatchedTicks; ++i) tick();
  watch(kWatchedTicks);
  // Only its integration damps it: it may oscillate, but not forever.
  while (out.accepted && what.damping == 0 && !out.settles() && held < kLongestHeldTicks) {
    watch(kLongWatchedTicks);
    held += kLongWatchedTicks;
  }
  out.held = held * kSoftTick;
  return out;
}

std::vector<SoftCase> soft_cases() {
  std::vector<SoftCase> out;
  struct Tool {
    double radius, poisson, damping;
  };
  for (const Tool& tool : {Tool{0.002, 0.45, 0.01}, Tool{0.002, 0.45, 0}, Tool{0.01, 0.49, 0.01}}) {
    for (const double young : kModuli) {
      for (const double rate : kRates) {
        for (const double spring : kSprings)
          out.push_back({young, spring, rate, tool.radius, tool.poisson, tool.damping});
      }
    }
  }
  return out;
}

std::vector<SoftCase> soft_cases_elsewhere(std::uint64_t seed) {
  Random random(seed);
  std::vector<SoftCase> out = soft_cases();
  for (SoftCase& one : out) {
    one.x = 0.04 * (random.unit() - 0.5);
    one.y = 0.04 * (random.unit() - 0.5);
    one.depth = 0.001 + 0.005 * random.unit();
    one.speed = 0.005 * std::pow(40, random.unit());
  }
  return out;
}

std::string soft_map_text(const std::vector<SoftSwing>& map) {
  std::string out =
      "Soft bodies: largest oscillation of the force, % of its mean, while the tool is held\n"
      "still; over springs of 200 to 3000 N/m and tools of 2 and 10 mm, among permitted settings.\n"
      "Held for 1.5 s; without damping up to 12.5 s, until it varies by at most 1 % in a second.\n"
      "-: none permitted\n\n"
      "       Pa ";
  char cell[48];
  for (const double rate : kRates) {
    std::snprintf(cell, sizeof cell, "%9g Hz", rate);
    out += cell;
  }
  out += '\n';
  int accepted = 0, settled = 0;
  double slowest = 0;
  for (const SoftSwing& one : map) {
    accepted += one.accepted;
    settled += one.accepted && one.settles();
    if (one.accepted && one.settles()) slowest = std::max(slowest, one.held);
  }
  for (const double young : kModuli) {
    std::snprintf(cell, sizeof cell, "%9.0f ", young);
    out += cell;
    for (const double rate : kRates) {
      const WorstSwing worst = worst_of(map, young, rate);
      if (worst.accepted) {
        std::snprintf(cell, sizeof cell, "%12.2f", 100 * worst.share);
      } else {
        std::snprintf(cell, sizeof cell, "%12s", "-");
      }
      out += worst.finite ? cell : "   no number";
    }
    out += '\n';
  }
  std::snprintf(cell, sizeof cell, "\n%d of %d cases", settled, accepted);
  out += cell;
  std::snprintf(cell, sizeof cell, " (1 %% at most), the slowest in %.1f s.\n", slowest);
  return out + " that scenes allow come to rest" + cell;
}

}  // namespace palpate::runner::evidence
