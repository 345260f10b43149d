#include "rendering/contact_detection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/facet_walk.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

using namespace minkowski;

constexpr int kSteps = 400;         // longer paths are left to the trees (first_contact)
constexpr double kSameTime = 1e-9;  // of a tick; closer times differ by rounding
constexpr double kApart = 1e-9;     // of the size; a probe farther off does not touch
constexpr double kNever = HUGE_VAL;

/// Both ends move linearly; time t from 0 to 1, d = tail - tip.
struct Motion {
  Vec3 tip, d, tip_motion, d_motion;

  Motion(const LineProbe& before, const LineProbe& after)
      : tip(before.tip),
        d(before.tail - before.tip),
        tip_motion(after.tip - before.tip),
        d_motion((after.tail - after.tip) - (before.tail - before.tip)) {}
  Vec3 tip_at(double t) const { return tip + t * tip_motion; }
  Vec3 d_at(double t) const { return d + t * d_motion; }
};

/// The time at which a height that is linear in time falls through 0; kNever if it ends above.
double time_of_fall(double before, double after) {
  if (after >= 0) return kNever;
  return before > 0 ? before / (before - after) : 0;
}

/// The time, from t on, at which the probe's line falls through the line of an edge: a root of the
/// quadratic (w(t) x d(t)) . e, whose sign gives the side on which the line passes.
double time_of_fall_on_edge(const stimuli::ConvexMesh& mesh, std::uint32_t index, bool left_ahead,
                            const Motion& m, double t) {
  const stimuli::Edge& edge = mesh.edges()[index];
  const Vec3& v0 = edge.from;
  const Vec3 e = (left_ahead ? -1.0 : 1.0) * (edge.to - v0);
  const Vec3 w = m.tip - v0;
  const double c0 = glm::dot(glm::cross(w, m.d), e);
  const double c1 = glm::dot(glm::cross(m.tip_motion, m.d) + glm::cross(w, m.d_motion), e);
  const double c2 = glm::dot(glm::cross(m.tip_motion, m.d_motion), e);
  const double discriminant = c1 * c1 - 4 * c2 * c0;
  if (!(discriminant >= 0)) return kNever;
  const double q = -0.5 * (c1 + std::copysign(std::sqrt(discriminant), c1));
  double first = kNever;
  for (const double root : {c2 != 0 ? q / c2 : kNever, q != 0 ? c0 / q : kNever}) {
    if (root >= t - kSameTime && root <= 1 && c1 + 2 * c2 * root < 0) first = std::min(first, root);
  }
  return std::max(first, t);
}

/// The facet of M whose plane separates the probe from the object, and since when.
struct Separation {
  ContactFeature feature;
  double since = 0;
};

/// The motion until one facet of M no longer separates: the end, or the next separation.
struct MotionStep {
  Approach end;  ///< undecided: continue with `next`
  Separation next;
};

MotionStep separated(const Separation& at, const Vec3& normal, double offset) {
  MotionStep step;
  step.end.end = Approach::End::separated;
  step.end.feature = at.feature;
  step.end.plane = {normal, offset, true};
  return step;
}

MotionStep entered(const Separation& at, double time) {
  MotionStep step;
  step.end.end = Approach::End::entered;
  step.end.feature = at.feature;
  step.end.time = time;
  return step;
}

MotionStep continue_with(ContactFeature facet, double since) {
  MotionStep step;
  step.next = {facet, since};
  return step;
}

template <bool kSegment>
MotionStep over_facet(const stimuli::ConvexMesh& mesh, const Separation& at, const Motion& m) {
  const stimuli::Facet& facet = mesh.facets()[at.feature.index];
  const double tip_before = glm::dot(facet.normal, m.tip) - facet.offset;
  const double tip_after = tip_before + glm::dot(facet.normal, m.tip_motion);
  double time = time_of_fall(tip_before, tip_after);
  bool tail_first = false;
  if constexpr (kSegment) {
    const double slope = glm::dot(facet.normal, m.d);
    const double slope_after = slope + glm::dot(facet.normal, m.d_motion);
    const double tail_time = time_of_fall(tip_before + slope, tip_after + slope_after);
    tail_first = tail_time < time;
    time = std::min(time, tail_time);
  }
  if (time == kNever) return separated(at, facet.normal, facet.offset);
  time = std::max(time, at.since);
  const Vec3 d = m.d_at(time);
  Vec3 end = m.tip_at(time);
  if (tail_first) end += d;
  const stimuli::Neighbour side = beyond_side(mesh, at.feature.index, end);
  if (side.edge == kNone) return entered(at, time);
  if constexpr (kSegment) {
    const bool here = glm::dot(facet.normal, d) >= 0;
    const bool there = glm::dot(mesh.facets()[side.across].normal, d) >= 0;
    if (here != there) {
      const bool left_ahead = (mesh.edges()[side.edge].left == at.feature.index) == here;
      return continue_with({Kind::edge, left_ahead, side.edge}, time);
    }
  }
  return continue_with({Kind::facet, false, side.across}, time);
}

/// The time at which dot(normal, d) changes its sign from the one at the edge; kNever if it does
/// not.
double turn_time(const Vec3& normal, bool ahead, const Motion& m) {
  const double before = glm::dot(normal, m.d), after = before + glm::dot(normal, m.d_motion);
  if ((after >= 0) == ahead) return kNever;
  return before == after ? 0 : before / (before - after);
}

MotionStep over_edge(const stimuli::ConvexMesh& mesh, const Separation& at, const Motion& m) {
  const std::uint32_t index = at.feature.index;
  const bool left_ahead = at.feature.left_ahead;
  const stimuli::Edge& edge = mesh.edges()[index];
  const double left_turns = turn_time(mesh.facets()[edge.left].normal, left_ahead, m);
  const double right_turns = turn_time(mesh.facets()[edge.right].normal, !left_ahead, m);
  const double turns = std::min(left_turns, right_turns);
  const double falls = time_of_fall_on_edge(mesh, index, left_ahead, m, at.since);
  if (turns < falls) {
    // At that time the edge's plane has become that facet's.
    return continue_with({Kind::facet, false, left_turns < right_turns ? edge.left : edge.right},
                         std::max(turns, at.since));
  }
  const double time = std::min(falls, 1.0);
  const Vec3 d = m.d_at(time);
  Measured measured;
  if (!measure_edge(mesh, index, left_ahead, m.tip_at(time), d, measured)) return {};
  if (falls == kNever) {
    if (!(measured.depth < 0)) return {};
    return separated(at, measured.normal, glm::dot(measured.normal, edge.from));
  }
  if (measured.probe_fraction < 0 || measured.probe_fraction > 1) {
    const bool to_left = (measured.probe_fraction < 0) == left_ahead;
    return continue_with({Kind::facet, false, to_left ? edge.left : edge.right}, time);
  }
  if (measured.edge_fraction < 0 || measured.edge_fraction > 1) {
    const SilhouetteEdge other =
        other_silhouette(mesh, index, measured.edge_fraction > 1, left_ahead, d);
    if (other.edge == kNone) return {};
    return continue_with({Kind::edge, other.left_ahead, other.edge}, time);
  }
  return entered(at, time);
}

/// An entry, if the probe is on the feature at that time. Undecided if rounding put the probe
/// beside or below it, as at edges nearly parallel to the probe.
template <bool kSegment>
Approach checked(const stimuli::ConvexMesh& mesh, const Approach& entry, const Motion& m) {
  const Vec3 tip = m.tip_at(entry.time), d = m.d_at(entry.time);
  Measured at;
  if (!kSegment || entry.feature.kind == Kind::facet) {
    at = measure_facet<kSegment>(mesh, entry.feature.index, tip, d);
  } else if (!measure_edge(mesh, entry.feature.index, entry.feature.left_ahead, tip, d, at)) {
    return {};
  }
  const double travel = glm::length(m.tip_motion) + glm::length(m.d_motion);
  const double tolerance = kApart * (mesh.size() + glm::length(d)) + kSameTime * travel;
  const bool on =
      std::abs(at.depth) <= tolerance && distance_off<kSegment>(mesh, at, tip, d) <= tolerance;
  return on ? entry : Approach{};
}

template <bool kSegment>
Approach approach(const stimuli::ConvexMesh& mesh, ContactFeature start, const LineProbe& before,
                  const LineProbe& after) {
  const Motion motion(before, after);
  Separation at{start, 0}, last{};
  for (int i = 0; i < kSteps; ++i) {
    const MotionStep step = kSegment && at.feature.kind == Kind::edge
                                ? over_edge(mesh, at, motion)
                                : over_facet<kSegment>(mesh, at, motion);
    if (step.end.end == Approach::End::entered) return checked<kSegment>(mesh, step.end, motion);
    if (step.end.end == Approach::End::separated) return step.end;
    if (step.next.feature.kind == Kind::none) return {};
    // Back and forth between two facets of M at one time: the probe is where they meet.
    if (step.next.feature == last.feature && step.next.since - last.since <= kSameTime) {
      return checked<kSegment>(mesh, entered(at, step.next.since).end, motion);
    }
    last = at;
    at = step.next;
  }
  return {};
}

}  // namespace

Approach approach_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                          const LineProbe& before, const LineProbe& after) {
  return approach<true>(mesh, start, before, after);
}

Approach approach_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                        const LineProbe& before, const LineProbe& after) {
  return approach<false>(mesh, start, before, after);
}

}  // namespace palpate::rendering
