#pragma once
// Random ways of a probe over one convex object, in the mesh's frame, for tests of renderers:
// sliding, wandering, fast passes, jumps. All lengths scale with the object.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "rendering/probe.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"

namespace palpate::testing {

using ProbePath = std::vector<rendering::LineProbe>;

inline double uniform(Random& random, double low, double high) {
  return low + (high - low) * random.unit();
}

inline Vec3 random_direction(Random& random) {
  return stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
}

inline Pose random_pose(Random& random, double reach) {
  return {reach * random_direction(random), stimuli::uniform_rotation(random)};
}

inline rendering::LineProbe to_world(const Pose& pose, const rendering::LineProbe& probe) {
  return {pose.orientation * probe.tip + pose.position,
          pose.orientation * probe.tail + pose.position};
}

inline rendering::LineProbe to_local(const Pose& pose, const rendering::LineProbe& probe) {
  const Quat back = glm::conjugate(pose.orientation);
  return {back * (probe.tip - pose.position), back * (probe.tail - pose.position)};
}

inline rendering::LineProbe moved(const rendering::LineProbe& probe, const Vec3& by) {
  return {probe.tip + by, probe.tail + by};
}

inline rendering::LineProbe mixed(const rendering::LineProbe& from, const rendering::LineProbe& to,
                                  double t) {
  return {from.tip + t * (to.tip - from.tip), from.tail + t * (to.tail - from.tail)};
}

/// Mean of the corners: inside, also where the bounding sphere's centre is not.
inline Vec3 middle_of(const stimuli::ConvexMesh& mesh) {
  Vec3 sum;
  for (const Vec3& v : mesh.vertices()) sum += v;
  return sum / static_cast<double>(mesh.vertices().size());
}

/// Depth of the middle: the half thickness, roughly. Small against the size for plates and needles.
inline double half_thickness(const stimuli::ConvexMesh& mesh) {
  const Vec3 middle = middle_of(mesh);
  return runner::evidence::reference_depth(mesh, {middle, middle}).depth;
}

/// A smooth random function of the distance travelled, within [-1, 1].
class Wave {
 public:
  explicit Wave(Random& random) {
    for (std::size_t i = 0; i < 3; ++i) {
      rate_[i] = uniform(random, 0.3, 1.0) * static_cast<double>(i + 1);
      phase_[i] = uniform(random, 0, 6.28318530717958648);
    }
  }
  double operator()(double travelled) const {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) sum += std::sin(rate_[i] * travelled + phase_[i]);
    return sum / 3;
  }

 private:
  std::array<double, 3> rate_{}, phase_{};
};

class Wave3 {
 public:
  explicit Wave3(Random& random) : x_(random), y_(random), z_(random) {}
  Vec3 operator()(double travelled) const { return {x_(travelled), y_(travelled), z_(travelled)}; }

 private:
  Wave x_, y_, z_;
};

inline Vec3 safe_direction(const Vec3& v) {
  const double length = glm::length(v);
  return length > 1e-6 ? v / length : Vec3(1, 0, 0);
}

/// The probe of this length and direction whose point at `share` of the way to the tail is `at`.
inline rendering::LineProbe probe_at(const Vec3& at, const Vec3& direction, double length,
                                     double share) {
  return {at - share * length * direction, at + (1 - share) * length * direction};
}

/// Smooth, in and out at any depth; about `step` sizes a tick.
inline ProbePath wandering_path(Random& random, const stimuli::ConvexMesh& mesh, double length,
                                int ticks, double step) {
  const Wave3 place(random), turn(random);
  const Wave share(random);
  ProbePath path;
  double travelled = 0;
  for (int tick = 0; tick < ticks; ++tick, travelled += step) {
    path.push_back(probe_at(mesh.centre() + 1.5 * mesh.radius() * place(travelled),
                            safe_direction(turn(travelled)), length, 0.5 + 0.5 * share(travelled)));
  }
  return path;
}

/// Starts well outside; then smooth and near the surface all the time: from a little outside to
/// `press` half thicknesses of depth along the ray from the middle. About `step` sizes a tick.
/// \param side  false: it is the tip that slides, wherever the rest of the probe is
inline ProbePath sliding_path(Random& random, const stimuli::ConvexMesh& mesh, double length,
                              int ticks, double step, double press = 0.3, bool side = true) {
  const Vec3 middle = middle_of(mesh);
  const double thickness = half_thickness(mesh);
  const double far = 2 * mesh.size() + length;
  const Wave3 place(random), turn(random);
  const Wave share(random), press_wave(random);
  ProbePath path;
  double travelled = 0;
  for (int tick = 0; tick < ticks; ++tick, travelled += step) {
    const Vec3 out = safe_direction(place(travelled));
    const Vec3 direction = safe_direction(turn(travelled));
    const double at_share = side ? 0.5 + 0.5 * share(travelled) : 0;
    double inside = 0;
    double outside = far;
    for (int halving = 0; halving < 24; ++halving) {
      const double half = (inside + outside) / 2;
      const rendering::LineProbe probe =
          probe_at(middle + half * out, direction, side ? length : 0, at_share);
      (runner::evidence::reference_depth(mesh, probe).depth > 0 ? inside : outside) = half;
    }
    const double depth = tick == 0 ? -far : thickness * press * (0.35 + press_wave(travelled));
    path.push_back(probe_at(middle + (inside - depth) * out, direction, length, at_share));
  }
  return path;
}

/// Straight passes through a point near the object, `step` sizes a tick, turning slowly; then a
/// jump to the start of the next one.
inline ProbePath fast_passes(Random& random, const stimuli::ConvexMesh& mesh, double length,
                             int ticks, double step) {
  ProbePath path;
  while (static_cast<int>(path.size()) < ticks) {
    const Vec3 aim = mesh.centre() + 0.6 * mesh.size() * random.unit() * random_direction(random);
    const Vec3 way = random_direction(random);
    const Vec3 from = random_direction(random);
    const Vec3 towards = safe_direction(from + 0.5 * random_direction(random));
    const double share = random.unit();
    const double reach = 1.5 * mesh.size() + length;
    const double pace = step * mesh.size() * uniform(random, 0.5, 1.5);
    double gone = -reach - pace * random.unit();
    for (int leg = 0; gone < reach && leg < 60; ++leg, gone += pace) {
      const double turned = 0.5 + 0.5 * gone / reach;
      path.push_back(probe_at(aim + gone * way, safe_direction(glm::mix(from, towards, turned)),
                              length, share));
    }
  }
  path.resize(static_cast<std::size_t>(ticks));
  return path;
}

/// Every tick somewhere else, often inside.
inline ProbePath jumping_path(Random& random, const stimuli::ConvexMesh& mesh, double length,
                              int ticks) {
  ProbePath path;
  for (int tick = 0; tick < ticks; ++tick) {
    const double reach = random.unit() < 0.5 ? mesh.radius() : 2 * mesh.size() + length;
    path.push_back(probe_at(mesh.centre() + reach * random.unit() * random_direction(random),
                            random_direction(random), length, random.unit()));
  }
  return path;
}

}  // namespace palpate::testing
