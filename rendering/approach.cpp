#include "rendering/approach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/minkowski_facets.h"

namespace palpate::rendering {
namespace {

using namespace minkowski;

constexpr int kSteps = 400;         // a longer way round is left to the trees
constexpr double kSameTime = 1e-9;  // of a tick; closer times differ by rounding
constexpr double kApart = 1e-9;     // of the size; a probe that is farther off does not touch
constexpr double kNever = HUGE_VAL;

/// Both ends move linearly; t from 0 to 1.
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

/// When a height that is linear in time has come through 0, downwards; never, if it ends above.
double fall(double before, double after) {
  if (after >= 0) return kNever;
  return before > 0 ? before / (before - after) : 0;
}

/// When the probe's line comes down through the line of an edge, from time t on: a root of the
/// quadratic (w(t) x d(t)) . e, whose sign says on which side the line passes.
double fall_on_edge(const stimuli::ConvexMesh& mesh, std::uint32_t index, bool left_ahead,
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

/// The facet of M that the probe is watched by, and the time from which on it separates.
struct Watch {
  MinkowskiFacet facet;
  double since = 0;
};

/// One facet's part of the motion: how it ends, or by which facet the probe is watched from when.
struct Stage {
  Approach end;  ///< undecided: goes on with `next`
  Watch next;
};

Stage separated(const Watch& at, const Vec3& normal, double offset) {
  Stage stage;
  stage.end.end = Approach::End::separated;
  stage.end.facet = at.facet;
  stage.end.plane = {normal, offset, true};
  return stage;
}

Stage entered(const Watch& at, double time) {
  Stage stage;
  stage.end.end = Approach::End::entered;
  stage.end.facet = at.facet;
  stage.end.time = time;
  return stage;
}

Stage go_on(MinkowskiFacet facet, double since) {
  Stage stage;
  stage.next = {facet, since};
  return stage;
}

template <bool kSegment>
Stage over_face(const stimuli::ConvexMesh& mesh, const Watch& at, const Motion& m) {
  const stimuli::Facet& facet = mesh.facets()[at.facet.index];
  const double tip_before = glm::dot(facet.normal, m.tip) - facet.offset;
  const double tip_after = tip_before + glm::dot(facet.normal, m.tip_motion);
  double time = fall(tip_before, tip_after);
  bool tail_first = false;
  if constexpr (kSegment) {
    const double slope = glm::dot(facet.normal, m.d);
    const double slope_after = slope + glm::dot(facet.normal, m.d_motion);
    const double tail_time = fall(tip_before + slope, tip_after + slope_after);
    tail_first = tail_time < time;
    time = std::min(time, tail_time);
  }
  if (time == kNever) return separated(at, facet.normal, facet.offset);
  time = std::max(time, at.since);
  const Vec3 d = m.d_at(time);
  Vec3 end = m.tip_at(time);
  if (tail_first) end += d;
  const stimuli::Neighbour side = beyond_side(mesh, at.facet.index, end);
  if (side.edge == kNone) return entered(at, time);
  if constexpr (kSegment) {
    const bool here = glm::dot(facet.normal, d) >= 0;
    const bool there = glm::dot(mesh.facets()[side.across].normal, d) >= 0;
    if (here != there) {
      const bool left_ahead = (mesh.edges()[side.edge].left == at.facet.index) == here;
      return go_on({Kind::edge, left_ahead, side.edge}, time);
    }
  }
  return go_on({Kind::face, false, side.across}, time);
}

/// When dot(normal, d) changes its sign from what it is over the edge; never, if it does not.
double turn_time(const Vec3& normal, bool ahead, const Motion& m) {
  const double before = glm::dot(normal, m.d), after = before + glm::dot(normal, m.d_motion);
  if ((after >= 0) == ahead) return kNever;
  return before == after ? 0 : before / (before - after);
}

Stage over_edge(const stimuli::ConvexMesh& mesh, const Watch& at, const Motion& m) {
  const std::uint32_t index = at.facet.index;
  const bool left_ahead = at.facet.left_ahead;
  const stimuli::Edge& edge = mesh.edges()[index];
  const double left_turns = turn_time(mesh.facets()[edge.left].normal, left_ahead, m);
  const double right_turns = turn_time(mesh.facets()[edge.right].normal, !left_ahead, m);
  const double turns = std::min(left_turns, right_turns);
  const double falls = fall_on_edge(mesh, index, left_ahead, m, at.since);
  if (turns < falls) {
    // There the edge's plane has become that face's.
    return go_on({Kind::face, false, left_turns < right_turns ? edge.left : edge.right},
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
  if (measured.place < 0 || measured.place > 1) {
    const bool to_left = (measured.place < 0) == left_ahead;
    return go_on({Kind::face, false, to_left ? edge.left : edge.right}, time);
  }
  if (measured.along_edge < 0 || measured.along_edge > 1) {
    const SilhouetteEdge other =
        other_silhouette(mesh, index, measured.along_edge > 1, left_ahead, d);
    if (other.edge == kNone) return {};
    return go_on({Kind::edge, other.left_ahead, other.edge}, time);
  }
  return entered(at, time);
}

/// An entry, if the probe is on the facet then; undecided where rounding put it beside or below:
/// edges nearly parallel to the probe.
template <bool kSegment>
Approach checked(const stimuli::ConvexMesh& mesh, const Approach& entry, const Motion& m) {
  const Vec3 tip = m.tip_at(entry.time), d = m.d_at(entry.time);
  Measured at;
  if (!kSegment || entry.facet.kind == Kind::face) {
    at = measure_face<kSegment>(mesh, entry.facet.index, tip, d);
  } else if (!measure_edge(mesh, entry.facet.index, entry.facet.left_ahead, tip, d, at)) {
    return {};
  }
  const double way = glm::length(m.tip_motion) + glm::length(m.d_motion);
  const double most = kApart * (mesh.size() + glm::length(d)) + kSameTime * way;
  const bool on = std::abs(at.depth) <= most && off_facet<kSegment>(mesh, at, tip, d) <= most;
  return on ? entry : Approach{};
}

template <bool kSegment>
Approach approach(const stimuli::ConvexMesh& mesh, MinkowskiFacet start, const LineProbe& before,
                  const LineProbe& after) {
  const Motion motion(before, after);
  Watch at{start, 0}, last{};
  for (int step = 0; step < kSteps; ++step) {
    const Stage stage = kSegment && at.facet.kind == Kind::edge
                            ? over_edge(mesh, at, motion)
                            : over_face<kSegment>(mesh, at, motion);
    if (stage.end.end == Approach::End::entered) return checked<kSegment>(mesh, stage.end, motion);
    if (stage.end.end == Approach::End::separated) return stage.end;
    if (stage.next.facet.kind == Kind::none) return {};
    // To and fro between two facets at one time: the probe is on the edge where they meet.
    if (stage.next.facet == last.facet && stage.next.since - last.since <= kSameTime) {
      return checked<kSegment>(mesh, entered(at, stage.next.since).end, motion);
    }
    last = at;
    at = stage.next;
  }
  return {};
}

}  // namespace

Approach approach_segment(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                          const LineProbe& before, const LineProbe& after) {
  return approach<true>(mesh, start, before, after);
}

Approach approach_point(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                        const LineProbe& before, const LineProbe& after) {
  return approach<false>(mesh, start, before, after);
}

}  // namespace palpate::rendering
