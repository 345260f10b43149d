#include "runner/evidence/verification/random_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "runner/evidence/verification/random_draws.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

/// 10 to a random power.
double magnitude(Random& random, double low_power, double high_power) {
  return std::pow(10, between(random, low_power, high_power));
}

Vec3 unit_or_x(const Vec3& v) {
  const double length = glm::length(v);
  return length > 1e-6 ? v / length : Vec3(1, 0, 0);
}

/// A smooth random function within [-1, 1].
class Wave {
 public:
  explicit Wave(Random& random) {
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      rates_[i] = between(random, 0.3, 1) * static_cast<double>(i + 1);
      phases_[i] = between(random, 0, 2 * std::numbers::pi);
    }
  }
  double operator()(double at) const {
    double sum = 0;
    for (std::size_t i = 0; i < rates_.size(); ++i) sum += std::sin(rates_[i] * at + phases_[i]);
    return sum / 3;
  }

 private:
  std::array<double, 3> rates_{}, phases_{};
};

struct Wave3 {
  explicit Wave3(Random& random) : x(random), y(random), z(random) {}
  Vec3 operator()(double at) const { return {x(at), y(at), z(at)}; }
  Wave x, y, z;
};

/// Builds a path pose by pose.
struct PathBuilder {
  Random& random;
  const stimuli::ConvexMesh& mesh;
  double length;
  bool side;
  std::size_t ticks;
  std::vector<rendering::LineProbe> path;

  bool full() const { return path.size() >= ticks; }

  /// The probe whose point at this fraction from tip to tail is at `at`.
  rendering::LineProbe probe(const Vec3& at, const Vec3& direction, double fraction) const {
    return {at - fraction * length * direction, at + (1 - fraction) * length * direction};
  }

  double some_fraction() { return side ? random.unit() : 0; }

  Vec3 middle() const {
    Vec3 sum;
    for (const Vec3& v : mesh.vertices()) sum += v;
    return sum / static_cast<double>(mesh.vertices().size());
  }

  void smooth() {
    const Wave3 position(random), turn(random);
    const Wave fraction(random);
    const double step = magnitude(random, -4, -1.5);
    const double reach = 1.5 * mesh.radius();
    for (double at = 0; !full(); at += step) {
      path.push_back(probe(mesh.centre() + reach * position(at), unit_or_x(turn(at)),
                           side ? 0.5 + 0.5 * fraction(at) : 0));
    }
  }

  void sliding() {
    const Vec3 inside = middle();
    const double thickness = reference_depth(mesh, {inside, inside}).depth;
    const double press = magnitude(random, -3, 0.5) * thickness;
    const double step = magnitude(random, -4, -1);
    const Wave3 position(random), turn(random);
    const Wave fraction(random), pressing(random);
    for (double at = 0; !full(); at += step) {
      const Vec3 out = unit_or_x(position(at)), direction = unit_or_x(turn(at));
      const double at_fraction = side ? 0.5 + 0.5 * fraction(at) : 0;
      double in = 0, outside = 2 * mesh.size() + length;
      for (int halving = 0; halving < 20; ++halving) {
        const double half = (in + outside) / 2;
        rendering::LineProbe there = probe(inside + half * out, direction, at_fraction);
        if (!side) there.tail = there.tip;
        (reference_depth(mesh, there).depth > 0 ? in : outside) = half;
      }
      const double depth = press * (0.35 + pressing(at));
      path.push_back(probe(inside + (in - depth) * out, direction, at_fraction));
    }
  }

  void fast() {
    constexpr double kFiveMetresASecond = 0.005;  // m a tick
    while (!full()) {
      const double step =
          random.below(2) ? kFiveMetresASecond : mesh.size() * magnitude(random, -2, 0.5);
      const Vec3 aim = mesh.centre() + 0.6 * mesh.size() * random.unit() * random_direction(random);
      const Vec3 motion = random_direction(random), from = random_direction(random);
      const Vec3 axis = random_direction(random);
      const double turn_a_tick = magnitude(random, -4, 0);
      const double fraction = some_fraction();
      const double legs = std::clamp((mesh.size() + length) / step, 2.0, 20.0);
      double gone = -step * (legs + random.unit());
      for (int leg = 0; leg <= 2 * legs && !full(); ++leg, gone += step) {
        const Vec3 direction = glm::angleAxis(turn_a_tick * leg, axis) * from;
        path.push_back(probe(aim + gone * motion, direction, fraction));
      }
    }
  }

  void plunges() {
    while (!full()) {
      // Through a weighted mean of corners, which is inside.
      Vec3 at = mesh.vertices()[0];
      for (int i = 1; i < 5; ++i) {
        at = glm::mix(at, mesh.vertices()[random.below(mesh.vertices().size())], random.unit());
      }
      const rendering::LineProbe inside = probe(at, random_direction(random), some_fraction());
      const rendering::LineProbe touching{inside.tip, side ? inside.tail : inside.tip};
      const ReferenceDepth reference = reference_depth(mesh, touching);
      if (reference.depth <= 0) continue;
      const Vec3 motion = random.below(2) ? reference.normal
                                          : unit_or_x(reference.normal + random_direction(random));
      const double start = reference.depth + mesh.size() * magnitude(random, -16, 0);
      const double deepest = reference.depth * between(random, -2, 1);
      path.push_back(
          {inside.tip + 2 * mesh.size() * motion, inside.tail + 2 * mesh.size() * motion});
      const int steps = 1 + static_cast<int>(random.below(6));
      for (int i = 0; i <= 2 * steps && !full(); ++i) {
        const double out = start + (deepest - start) * (steps - std::abs(i - steps)) / steps;
        path.push_back({inside.tip + out * motion, inside.tail + out * motion});
      }
    }
  }

  void jumps() {
    while (!full()) {
      const double reach = random.below(2) ? mesh.radius() : 2 * mesh.size() + length;
      path.push_back(probe(mesh.centre() + reach * random.unit() * random_direction(random),
                           random_direction(random), some_fraction()));
    }
  }

  /// 0, or of any magnitude from 1e-17 to 1e-2.
  double tiny() {
    const double amount = random.below(3) ? magnitude(random, -17, -2) : 0;
    return random.below(2) ? amount : -amount;
  }

  void aligned() {
    const double size = mesh.size();
    const auto pick = [&](const auto& items) { return items[random.below(items.size())]; };
    while (!full()) {
      const stimuli::Edge edge = pick(mesh.edges());
      const Vec3 &v0 = edge.from, &v1 = edge.to;
      const Vec3 along = glm::normalize(v1 - v0);
      const Vec3 normal = mesh.facets()[edge.left].normal;
      const Vec3 across = glm::cross(normal, along);
      const std::array directions{along, across, normal, unit_or_x(along + across),
                                  unit_or_x(pick(mesh.vertices()) - v0)};
      Vec3 direction = unit_or_x(pick(directions) + tiny() * random_direction(random));
      if (random.below(2)) direction = -direction;
      const Vec3 touch = random.below(2) ? v0 : v0 + random.unit() * (v1 - v0);
      const std::array motions{normal, along, across, direction,
                               unit_or_x(normal + mesh.facets()[edge.right].normal)};
      const Vec3 motion = pick(motions);
      const Vec3 second = pick(motions);
      const double fraction = side && random.below(2)
                                  ? random.unit()
                                  : (side ? static_cast<double>(random.below(2)) : 0);
      const double reach = size * magnitude(random, -6, 0), beside = size * tiny();
      const double turning = random.below(2) ? tiny() : 0;
      const Vec3 axis = random_direction(random);
      const int legs = 4 + static_cast<int>(random.below(20));
      path.push_back(
          probe(touch + 2 * size * unit_or_x(normal + 0.1 * across), direction, fraction));
      for (int leg = 0; leg <= legs && !full(); ++leg) {
        const double turn = 2 * std::numbers::pi * leg / legs;
        const Vec3 at = touch + (reach * std::cos(turn) + beside) * motion +
                        (random.below(4) ? 0 : reach * std::sin(turn)) * second;
        path.push_back(probe(at, glm::angleAxis(turning * leg, axis) * direction, fraction));
      }
    }
  }
};

}  // namespace

const char* to_string(PathKind kind) {
  constexpr const char* kNames[] = {"smooth", "sliding", "fast", "plunges", "jumps", "aligned"};
  return kNames[static_cast<int>(kind)];
}

std::vector<rendering::LineProbe> random_path(Random& random, PathKind kind,
                                              const stimuli::ConvexMesh& mesh, double length,
                                              bool side, std::size_t ticks) {
  PathBuilder builder{random, mesh, length, side, ticks, {}};
  builder.path.reserve(ticks + 1);
  const double far = 3 * mesh.size() + length;
  builder.path.push_back(builder.probe(mesh.centre() + far * Vec3(0, 0, 1), Vec3(0, 0, 1), 0));
  switch (kind) {
    case PathKind::smooth:
      builder.smooth();
      break;
    case PathKind::sliding:
      builder.sliding();
      break;
    case PathKind::fast:
      builder.fast();
      break;
    case PathKind::plunges:
      builder.plunges();
      break;
    case PathKind::jumps:
      builder.jumps();
      break;
    case PathKind::aligned:
      builder.aligned();
      break;
  }
  builder.path.resize(ticks);
  return std::move(builder.path);
}

}  // namespace palpate::runner::evidence
