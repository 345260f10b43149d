#pragma once
// Signed distances of hypotheses along one line, for stimuli without a formula.

#include <cmath>
#include <utility>

#include "runner/participants/distance_field.h"
#include "runner/participants/lane_math.h"
#include "runner/participants/shape_hypotheses.h"
#include "runner/participants/shape_lines.h"

namespace palpate::runner::participants {

/// As many lines as a register has lanes.
struct LanesOfLines {
  const DistanceField* field = nullptr;
  lane::Floats start[3], along[3];

  LanesOfLines() = default;
  template <class Rows>
  LanesOfLines(const DistanceField& solid, const Rows& rows, int first) : field(&solid) {
    for (int a = 0; a < 3; ++a) {
      start[a] = lane::load(rows.start[a] + first);
      along[a] = lane::load(rows.along[a] + first);
    }
  }
  lane::Floats distances(const lane::Floats& s) const {
    return field->distances(start[0] + s * along[0], start[1] + s * along[1],
                            start[2] + s * along[2]);
  }
  DistanceField::Values values(const lane::Floats& s) const {
    return field->values(start[0] + s * along[0], start[1] + s * along[1], start[2] + s * along[2]);
  }
};

/// Where lines enter and leave the box of a solid, grown by some length in each direction.
class BoxCrossing {
 public:
  BoxCrossing() = default;
  explicit BoxCrossing(const LanesOfLines& lines) {
    const DistanceField::Box& box = lines.field->box();
    for (int a = 0; a < 3; ++a) {
      const lane::Floats along = lines.along[a], off = lines.start[a] - box.middle[a];
      per_[a] = 1.0F / lane::max(lane::abs(along), lane::all(1e-9F));
      const lane::Floats middle = (along < 0.0F ? off : -off) * per_[a],
                         half = box.half[a] * per_[a];
      begin_[a] = middle - half;
      end_[a] = middle + half;
    }
  }
  /// m from the start of each line
  lane::Floats begin(const lane::Floats& grown) const {
    const auto of = [&](int a) { return begin_[a] - grown * per_[a]; };
    return lane::max(lane::max(of(0), of(1)), of(2));
  }
  lane::Floats end(const lane::Floats& grown) const {
    const auto of = [&](int a) { return end_[a] + grown * per_[a]; };
    return lane::min(lane::min(of(0), of(1)), of(2));
  }

 private:
  lane::Floats per_[3], begin_[3], end_[3];
};

/// A solid that is not convex may have several local minima along a line. Samples it in at most
/// `kPlaces` steps, fewer where the distance (its slope is at most 1) rules out a new minimum, and
/// only as far as the box allows one; then refines around the least sample. Finds the minimum
/// within 0.5 mm. Groups of lines, a register's lanes each, take turns, because a single one would
/// wait for the grid's memory at each step.
/// \param best  places of the first `count` lines, m from the start; \param least  distances there.
/// Both have as much room as the rows.
template <int kRoom>
void search_lines(const DistanceField& field, const LineRows<kRoom>& rows, int count, float length,
                  float* best, float* least) {
  using lane::Floats;
  constexpr int kPlaces = 16, kHalvings = 5;
  constexpr int kMostGroups = (kRoom + lane::kWidth - 1) / lane::kWidth;
  const Floats step = lane::all(length / kPlaces), whole = lane::all(length),
               end = lane::all(length + 0.5F * (length / kPlaces));
  const int groups = (count + lane::kWidth - 1) / lane::kWidth;
  BoxCrossing crossings[kMostGroups];
  Floats next[kMostGroups];
  lane::Ints going[kMostGroups];
  int active[kMostGroups];
  int left = 0;
  // Counts the group as active again if one of its lines has a place to be looked at.
  const auto advance = [&](int g, const Floats& farther, const Floats& so_far) {
    next[g] = farther;
    going[g] = (farther < end) & (lane::min(farther, whole) <= crossings[g].end(so_far));
    active[left] = g;
    left += lane::any(going[g]) ? 1 : 0;
  };
  for (int g = 0; g < groups; ++g) {
    const int first = g * lane::kWidth;
    const LanesOfLines lines(field, rows, first);
    crossings[g] = BoxCrossing(lines);
    const Floats d = lines.distances(Floats{});
    lane::store(Floats{}, best + first);
    lane::store(d, least + first);
    advance(g, step, d);
  }
  while (left > 0) {
    const int turns = std::exchange(left, 0);
    for (int turn = 0; turn < turns; ++turn) {
      const int g = active[turn], first = g * lane::kWidth;
      const Floats best_so_far = lane::load(best + first), so_far = lane::load(least + first);
      // A line that has ended would leave the grid, which takes longer to look at.
      const Floats place = going[g] ? lane::min(next[g], whole) : best_so_far;
      const Floats d = LanesOfLines(field, rows, first).distances(place);
      const lane::Ints closer = d < so_far;
      const Floats now = closer ? d : so_far;
      lane::store(now, least + first);
      lane::store(closer ? place : best_so_far, best + first);
      advance(g, next[g] + lane::max(step, d - now), now);
    }
  }
  Floats reach = 0.5F * step;
  for (int k = 0; k < kHalvings; ++k, reach *= 0.5F) {
    for (int g = 0; g < groups; ++g) {
      const int first = g * lane::kWidth;
      const LanesOfLines lines(field, rows, first);
      const Floats middle = lane::load(best + first), so_far = lane::load(least + first);
      const Floats before = lane::max(middle - reach, Floats{});
      const Floats after = lane::min(middle + reach, whole);
      const Floats b = lines.distances(after);
      // There is nothing before the start.
      const Floats a = lane::any(middle > 0.0F) ? lines.distances(before) : so_far;
      const lane::Ints back = (a < so_far) & (a <= b);
      const lane::Ints on = ~back & (b < so_far);
      lane::store(back ? a : on ? b : so_far, least + first);
      lane::store(back ? before : on ? after : middle, best + first);
    }
  }
}

inline FloatVec unit(const FloatVec& v) {
  const float scale = 1.0F / std::sqrt(lane::max(dot(v, v), kTinyLength * kTinyLength));
  return {v.x * scale, v.y * scale, v.z * scale};
}

/// Three rows of vectors.
struct LanesOfVectors {
  lane::Floats x, y, z;
};
inline lane::Floats dot(const LanesOfVectors& a, const LanesOfVectors& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline LanesOfVectors unit(const LanesOfVectors& v) {
  const lane::Floats scale =
      1.0F / lane::sqrt(lane::max(dot(v, v), lane::all(kTinyLength * kTinyLength)));
  return {v.x * scale, v.y * scale, v.z * scale};
}

/// Distance and outward normal at some places of lines, m from the start.
struct LanesOfSurface {
  lane::Floats distance;
  LanesOfVectors normal;
};
inline LanesOfSurface surface_at(const LanesOfLines& lines, const lane::Floats& place,
                                 float length) {
  const DistanceField::Values there = lines.values(place);
  const LanesOfVectors normal = unit(LanesOfVectors{there.slope_x, there.slope_y, there.slope_z});
  if (length <= 0) return {there.distance, normal};
  // Between the ends, a contact's normal is perpendicular to the line.
  const LanesOfVectors u{lines.along[0], lines.along[1], lines.along[2]};
  const lane::Floats climb = dot(normal, u);
  const LanesOfVectors across =
      unit(LanesOfVectors{normal.x - climb * u.x, normal.y - climb * u.y, normal.z - climb * u.z});
  const lane::Ints between = (place > 0.0F) & (place < length);
  return {there.distance,
          {between ? across.x : normal.x, between ? across.y : normal.y,
           between ? across.z : normal.z}};
}

/// One block of hypotheses. Has the functions of the classes of shape_lines.h.
class SolidLine : public RotatedLine {
 public:
  SolidLine(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape, int first,
            const Line& line)
      : RotatedLine(hypotheses, first, line), field_(shape.field.get()) {}

  float distance(int i, float s) const {
    const FloatVec p = at(i, s);
    return field_->distance(p.x, p.y, p.z);
  }
  SurfacePoint surface(int i, float s) const {
    const FloatVec p = at(i, s);
    const DistanceField::Value v = field_->value(p.x, p.y, p.z);
    return {v.distance, unit(FloatVec{v.slope_x, v.slope_y, v.slope_z})};
  }
  const DistanceField& field() const { return *field_; }
  const LineRows<ShapeHypotheses::kBlock>& rows() const { return rows_; }

 private:
  const DistanceField* field_;
};

}  // namespace palpate::runner::participants
