#pragma once
// Signed distances of one block of hypotheses along one line p(s) = start + s * along, each with
// its direction: analytic, branch-free, in single precision (within a micrometre, 0.2 m around).
//
// Every class has these functions for hypothesis i of the block, s in metres:
//   distance(i, s)  m, negative inside
//   slope(i, s)     has the sign of the distance's derivative along the line
//   surface(i, s)   distance and unit outward normal, in a frame that the class chooses
//   along(i)        the line's direction in that frame
//   cosine(i, v)    scalar product of a vector of that frame with the perceived direction
//   world(i, v)     a vector of that frame in the world frame

#include <cmath>
#include <type_traits>
#include <utility>

#include "runner/participants/distance_field.h"
#include "runner/participants/lane_math.h"
#include "runner/participants/shape_hypotheses.h"
#include "runner/participants/shape_profiles.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

struct FloatVec {
  float x, y, z;
};

inline float dot(const FloatVec& a, const FloatVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline FloatVec to_float(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

struct SurfacePoint {
  float distance;   // m
  FloatVec normal;  // unit
};

/// The line, the same for all hypotheses.
struct Line {
  FloatVec start;      // m, from the object's centre
  FloatVec along;      // unit, or zero for a point
  float length;        // m
  FloatVec direction;  // unit, perceived
};

// Keeps divisions by lengths near zero finite; far below all relevant lengths.
inline constexpr float kTinyLength = 1e-12f;  // m

class SphereLine {
 public:
  SphereLine(const ShapeHypotheses& /*hypotheses*/, const ShapeHypotheses::Shape& shape,
             int /*first*/, const Line& line)
      : line_(line), radius_(shape.radius) {}

  float distance(int /*i*/, float s) const {
    const FloatVec p = at(s);
    return std::sqrt(dot(p, p)) - radius_;
  }
  float slope(int /*i*/, float s) const { return dot(at(s), line_.along); }
  SurfacePoint surface(int /*i*/, float s) const {
    const FloatVec p = at(s);
    const float range = std::sqrt(dot(p, p));
    const float scale = 1.0f / lane::max(range, kTinyLength);
    return {range - radius_, {p.x * scale, p.y * scale, p.z * scale}};
  }
  FloatVec along(int /*i*/) const { return line_.along; }
  float cosine(int /*i*/, const FloatVec& v) const { return dot(v, line_.direction); }
  FloatVec world(int /*i*/, const FloatVec& v) const { return v; }

 private:
  FloatVec at(float s) const {
    return {line_.start.x + s * line_.along.x, line_.start.y + s * line_.along.y,
            line_.start.z + s * line_.along.z};
  }

  Line line_;
  float radius_;
};

/// A line in the frames of kBlock rotations of one stimulus.
class RotatedLine {
 public:
  RotatedLine(const ShapeHypotheses& hypotheses, int first, const Line& line)
      : hypotheses_(&hypotheses), which_(hypotheses.nearby_order() + first) {
    for (int a = 0; a < 3; ++a) {
      const float* x = hypotheses.axis_component(a, 0);
      const float* y = hypotheses.axis_component(a, 1);
      const float* z = hypotheses.axis_component(a, 2);
      for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
        const FloatVec axis{x[which_[i]], y[which_[i]], z[which_[i]]};
        start_[a][i] = dot(axis, line.start);
        along_[a][i] = dot(axis, line.along);
        direction_[a][i] = dot(axis, line.direction);
      }
    }
  }

  FloatVec along(int i) const { return {along_[0][i], along_[1][i], along_[2][i]}; }
  float cosine(int i, const FloatVec& v) const {
    return v.x * direction_[0][i] + v.y * direction_[1][i] + v.z * direction_[2][i];
  }
  FloatVec world(int i, const FloatVec& v) const {
    const auto component = [&](int c) {
      return v.x * hypotheses_->axis_component(0, c)[which_[i]] +
             v.y * hypotheses_->axis_component(1, c)[which_[i]] +
             v.z * hypotheses_->axis_component(2, c)[which_[i]];
    };
    return {component(0), component(1), component(2)};
  }

 protected:
  FloatVec at(int i, float s) const {
    return {start_[0][i] + s * along_[0][i], start_[1][i] + s * along_[1][i],
            start_[2][i] + s * along_[2][i]};
  }

 private:
  const ShapeHypotheses* hypotheses_;
  const int* which_;
  float start_[3][ShapeHypotheses::kBlock];
  float along_[3][ShapeHypotheses::kBlock];
  float direction_[3][ShapeHypotheses::kBlock];
};

/// In the cube's frame.
class CubeLine : public RotatedLine {
 public:
  CubeLine(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape, int first,
           const Line& line)
      : RotatedLine(hypotheses, first, line), half_(shape.half_size) {}

  float distance(int i, float s) const {
    const FloatVec e = excess(at(i, s));
    const float x = lane::positive(e.x);
    const float y = lane::positive(e.y);
    const float z = lane::positive(e.z);
    const float inside = lane::min(lane::max(lane::max(e.x, e.y), e.z), 0.0f);
    return std::sqrt(x * x + y * y + z * z) + inside;
  }
  float slope(int i, float s) const { return dot(outward(at(i, s)), along(i)); }
  SurfacePoint surface(int i, float s) const {
    const FloatVec g = outward(at(i, s));
    const float scale = 1.0f / std::sqrt(lane::max(dot(g, g), kTinyLength * kTinyLength));
    return {distance(i, s), {g.x * scale, g.y * scale, g.z * scale}};
  }

 private:
  FloatVec excess(const FloatVec& p) const {
    return {std::fabs(p.x) - half_, std::fabs(p.y) - half_, std::fabs(p.z) - half_};
  }
  /// Along the outward normal, of any positive length: outside, from the nearest point of the
  /// cube; inside, of the nearest face.
  FloatVec outward(const FloatVec& p) const {
    const FloatVec e = excess(p);
    const float most = lane::max(lane::max(e.x, e.y), e.z);
    const bool outside = most > 0.0f;
    const float x = outside ? lane::positive(e.x) : (e.x < most ? 0.0f : 1.0f);
    const float y = outside ? lane::positive(e.y) : (e.y < most ? 0.0f : 1.0f);
    const float z = outside ? lane::positive(e.z) : (e.z < most ? 0.0f : 1.0f);
    return {x * lane::sign(p.x), y * lane::sign(p.y), z * lane::sign(p.z)};
  }

  float half_;
};

/// Solids of revolution; works in the world frame. Positions on the line are relative to its point
/// nearest to the axis: all terms of the squared radius are then positive, without cancellation.
template <class Profile>
class AxialLine {
 public:
  AxialLine(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape, int first,
            const Line& line)
      : profile_(shape), line_(line) {
    const float* x = hypotheses.axis_component(2, 0) + first;
    const float* y = hypotheses.axis_component(2, 1) + first;
    const float* z = hypotheses.axis_component(2, 2) + first;
    for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
      const FloatVec axis{x[i], y[i], z[i]};
      const float height = dot(axis, line.start);
      const float climb = dot(axis, line.along);
      const FloatVec q{line.start.x - height * axis.x, line.start.y - height * axis.y,
                       line.start.z - height * axis.z};
      const FloatVec u{line.along.x - climb * axis.x, line.along.y - climb * axis.y,
                       line.along.z - climb * axis.z};
      const float uu = dot(u, u);
      const float nearest = lane::clamp(-dot(q, u) / lane::max(uu, kTinyLength), 0.0f, line.length);
      const FloatVec n{q.x + nearest * u.x, q.y + nearest * u.y, q.z + nearest * u.z};
      axis_[0][i] = axis.x;
      axis_[1][i] = axis.y;
      axis_[2][i] = axis.z;
      across_[0][i] = u.x;
      across_[1][i] = u.y;
      across_[2][i] = u.z;
      from_axis_[0][i] = n.x;
      from_axis_[1][i] = n.y;
      from_axis_[2][i] = n.z;
      nearest_[i] = nearest;
      height_[i] = height + nearest * climb;
      climb_[i] = climb;
      constant_[i] = dot(n, n);
      linear_[i] = dot(n, u);
      square_[i] = uu;
    }
  }

  float distance(int i, float s) const {
    const float t = s - nearest_[i];
    return profile_.distance(radius(i, t), height_[i] + t * climb_[i]);
  }
  float slope(int i, float s) const {
    const float t = s - nearest_[i];
    const float r = radius(i, t);
    const ProfileVec g = profile_.outward(r, height_[i] + t * climb_[i]);
    return g.radial * (linear_[i] + t * square_[i]) + g.axial * climb_[i] * r;
  }
  SurfacePoint surface(int i, float s) const {
    const float t = s - nearest_[i];
    const float r = radius(i, t);
    const float height = height_[i] + t * climb_[i];
    const ProfileVec g = profile_.outward(r, height);
    const float size = g.radial * g.radial + g.axial * g.axial;
    const float scale = 1.0f / std::sqrt(lane::max(size, kTinyLength * kTinyLength));
    const float radial = g.radial * scale / lane::max(r, kTinyLength);
    const float axial = g.axial * scale;
    return {profile_.distance(r, height),
            {radial * (from_axis_[0][i] + t * across_[0][i]) + axial * axis_[0][i],
             radial * (from_axis_[1][i] + t * across_[1][i]) + axial * axis_[1][i],
             radial * (from_axis_[2][i] + t * across_[2][i]) + axial * axis_[2][i]}};
  }
  FloatVec along(int /*i*/) const { return line_.along; }
  float cosine(int /*i*/, const FloatVec& v) const { return dot(v, line_.direction); }
  FloatVec world(int /*i*/, const FloatVec& v) const { return v; }

 private:
  float radius(int i, float t) const {
    return std::sqrt(lane::positive(constant_[i] + t * (2.0f * linear_[i] + t * square_[i])));
  }

  Profile profile_;
  Line line_;
  float axis_[3][ShapeHypotheses::kBlock];
  float across_[3][ShapeHypotheses::kBlock];     // the line's direction, its part across the axis
  float from_axis_[3][ShapeHypotheses::kBlock];  // m, from the axis to the line's nearest point
  float nearest_[ShapeHypotheses::kBlock];       // m along the line
  float height_[ShapeHypotheses::kBlock];        // m along the axis, there
  float climb_[ShapeHypotheses::kBlock];         // m along the axis for a metre of the line
  // Squared radius = constant + 2 linear t + square t^2, t in metres from there.
  float constant_[ShapeHypotheses::kBlock];
  float linear_[ShapeHypotheses::kBlock];
  float square_[ShapeHypotheses::kBlock];
};

// The deepest point of the perceived tip or stylus in each hypothesis of a block.

// The search along a line ends when the minimum is bracketed within this length. The distance
// itself is within 30 micrometres: it is interpolated from the slopes at both ends.
inline constexpr float kSearchedLength = 0.00012f;  // m
inline constexpr int kMostHalvings = 20;

/// The deepest point of the line, of every hypothesis of a block.
struct Deepest {
  float distance[ShapeHypotheses::kBlock];  // m
  float cosine[ShapeHypotheses::kBlock];    // outward normal . perceived direction
  float along[ShapeHypotheses::kBlock];     // m from the line's start
  float x[ShapeHypotheses::kBlock];         // unit outward normal, in the shape's own frame
  float y[ShapeHypotheses::kBlock];
  float z[ShapeHypotheses::kBlock];
};

template <class ShapeLine>
void find_at_tip(const ShapeLine& shape, Deepest& out) {
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
    const SurfacePoint p = shape.surface(i, 0.0f);
    out.distance[i] = p.distance;
    out.cosine[i] = shape.cosine(i, p.normal);
    out.along[i] = 0.0f;
    out.x[i] = p.normal.x;
    out.y[i] = p.normal.y;
    out.z[i] = p.normal.z;
  }
}

/// Surface and slope at one point of the line, for every hypothesis of a block.
struct SlopedSurface {
  float distance[ShapeHypotheses::kBlock];  // m
  float slope[ShapeHypotheses::kBlock];     // of the distance along the line
  float x[ShapeHypotheses::kBlock];         // unit outward normal, in the shape's own frame
  float y[ShapeHypotheses::kBlock];
  float z[ShapeHypotheses::kBlock];
};

template <class ShapeLine>
inline void store(const ShapeLine& shape, int i, float s, SlopedSurface& out) {
  const SurfacePoint p = shape.surface(i, s);
  out.distance[i] = p.distance;
  out.slope[i] = dot(p.normal, shape.along(i));
  out.x[i] = p.normal.x;
  out.y[i] = p.normal.y;
  out.z[i] = p.normal.z;
}

/// Bisection: the distance to a convex shape is convex along a line, so the sign of its slope tells
/// on which side the minimum lies.
template <class ShapeLine>
void find_along_line(const ShapeLine& shape, float length, Deepest& out) {
  // Half length and middle of the bracket.
  float reach = 0.5f * length;
  float middle[ShapeHypotheses::kBlock];
  for (float& m : middle) m = reach;
  for (int step = 0; step < kMostHalvings && 2.0f * reach > kSearchedLength; ++step) {
    reach *= 0.5f;
    for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
      middle[i] -= std::copysign(reach, shape.slope(i, middle[i]));
    }
  }
  // Separate loops: in a single one g++ 12 turns the selections into branches and does not
  // vectorise.
  SlopedSurface a;
  SlopedSurface b;
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) store(shape, i, middle[i] - reach, a);
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) store(shape, i, middle[i] + reach, b);
  const float width = 2.0f * reach;
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
    // The tangents at a and b intersect at the minimum if it is a kink, and just below a smooth
    // minimum. The combination of the two normals with slope zero is perpendicular to the line. If
    // both slopes have the same sign, the other is set to zero and an end of the line is the
    // minimum.
    const float falling = lane::min(a.slope[i], 0.0f);
    const float rising = lane::max(b.slope[i], 0.0f);
    const float bend = lane::max(rising - falling, 1e-6f);
    const float meet =
        lane::clamp((a.distance[i] - b.distance[i] + rising * width) / bend, 0.0f, width);
    const float weight_b = -falling / bend;
    const float weight_a = 1.0f - weight_b;
    const FloatVec n{weight_a * a.x[i] + weight_b * b.x[i], weight_a * a.y[i] + weight_b * b.y[i],
                     weight_a * a.z[i] + weight_b * b.z[i]};
    const float size = std::sqrt(lane::max(dot(n, n), 1e-12f));
    out.distance[i] = a.distance[i] + falling * meet;
    out.cosine[i] = shape.cosine(i, n) / size;
    out.along[i] = middle[i] - reach + meet;
    out.x[i] = n.x / size;
    out.y[i] = n.y / size;
    out.z[i] = n.z / size;
  }
}

// Signed distances of one block of hypotheses along one line, for stimuli without a formula. The
// functions are those of shape_lines.h.

/// Works in the stimulus' frame.
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
    return {v.distance, unit({v.slope_x, v.slope_y, v.slope_z})};
  }
  FloatVec start(int i) const { return at(i, 0); }
  const DistanceField& field() const { return *field_; }

  static FloatVec unit(const FloatVec& v) {
    const float scale = 1.0f / std::sqrt(lane::max(dot(v, v), kTinyLength * kTinyLength));
    return {v.x * scale, v.y * scale, v.z * scale};
  }

 private:
  const DistanceField* field_;
};
static_assert(DistanceField::kMost == ShapeHypotheses::kBlock);

/// Some hypotheses of a block, side by side, so that no work is done for the others.
class ChosenLines {
 public:
  static constexpr int kBlock = ShapeHypotheses::kBlock;

  explicit ChosenLines(const SolidLine& shape) : field_(&shape.field()) {
    for (int i = 0; i < kBlock; ++i) {
      const FloatVec start = shape.start(i), along = shape.along(i);
      which_[i] = i;
      start_[0][i] = start.x;
      start_[1][i] = start.y;
      start_[2][i] = start.z;
      along_[0][i] = along.x;
      along_[1][i] = along.y;
      along_[2][i] = along.z;
    }
  }

  int count() const { return count_; }
  int which(int k) const { return which_[k]; }  ///< of the block's hypotheses

  /// Keeps those for which keep(k); calls move(from, to) for each of them that takes another place.
  template <class Keep, class Move>
  void keep_if(const Keep& keep, const Move& move) {
    int kept = 0;
    for (int k = 0; k < count_; ++k) {
      if (!keep(k)) continue;
      if (kept != k) {
        which_[kept] = which_[k];
        for (int a = 0; a < 3; ++a) {
          start_[a][kept] = start_[a][k];
          along_[a][kept] = along_[a][k];
        }
        move(k, kept);
      }
      ++kept;
    }
    count_ = kept;
  }

  /// At the place s[k] of each line.
  void distances(const float* s, float* out) const {
    DistanceField::Places places;
    find_places(s, places);
    field_->distances(places, count_, out);
  }
  void values(const float* s, DistanceField::Values& out) const {
    DistanceField::Places places;
    find_places(s, places);
    field_->values(places, count_, out);
  }

 private:
  void find_places(const float* s, DistanceField::Places& places) const {
    constexpr int kLanes = DistanceField::kLanes;
    for (int first = 0; first < count_; first += kLanes) {
      for (int i = first; i < first + kLanes; ++i) {
        places.x[i] = start_[0][i] + s[i] * along_[0][i];
        places.y[i] = start_[1][i] + s[i] * along_[1][i];
        places.z[i] = start_[2][i] + s[i] * along_[2][i];
      }
    }
  }

  const DistanceField* field_;
  int count_ = kBlock;
  int which_[kBlock];
  float start_[3][kBlock], along_[3][kBlock];
};

/// A solid that is not convex may have several local minima along the line. Samples it in at most
/// `kPlaces` steps, fewer where the distance (its slope is at most 1) rules out a new minimum; then
/// refines around the least sample. Finds the minimum within 0.5 mm. Many hypotheses advance
/// together, because a single one would wait for the grid's memory at each step.
inline void find_along_line(const SolidLine& shape, float length, Deepest& out) {
  constexpr int kBlock = ShapeHypotheses::kBlock;
  constexpr int kPlaces = 16;
  constexpr int kHalvings = 5;
  const float step = length / kPlaces;
  const float end = length + 0.5f * step;
  float found_best[kBlock], found_least[kBlock];
  {
    ChosenLines going_on(shape);
    float best[kBlock] = {}, least[kBlock], next[kBlock], place[kBlock], d[kBlock];
    going_on.distances(best, least);
    std::fill_n(next, kBlock, step);
    while (going_on.count() > 0) {
      const int count = going_on.count();
      for (int i = 0; i < kBlock; ++i) place[i] = lane::min(next[i], length);
      going_on.distances(place, d);
      int ended = 0;
      for (int i = 0; i < kBlock; ++i) {
        const bool closer = next[i] < end && d[i] < least[i];
        least[i] = closer ? d[i] : least[i];
        best[i] = closer ? place[i] : best[i];
        next[i] += lane::max(step, d[i] - least[i]);
        ended += i < count && !(next[i] < end) ? 1 : 0;
      }
      if (4 * ended < count && ended < DistanceField::kLanes) continue;
      for (int k = 0; k < count; ++k) {
        found_best[going_on.which(k)] = best[k];
        found_least[going_on.which(k)] = least[k];
      }
      going_on.keep_if([&](int k) { return next[k] < end; },
                       [&](int from, int to) {
                         best[to] = best[from];
                         least[to] = least[from];
                         next[to] = next[from];
                       });
    }
  }
  const ChosenLines all(shape);
  float reach = 0.5f * step;
  for (int k = 0; k < kHalvings; ++k, reach *= 0.5f) {
    float before[kBlock], after[kBlock], a[kBlock], b[kBlock];
    for (int i = 0; i < kBlock; ++i) {
      before[i] = lane::max(found_best[i] - reach, 0.0f);
      after[i] = lane::min(found_best[i] + reach, length);
    }
    all.distances(before, a);
    all.distances(after, b);
    for (int i = 0; i < kBlock; ++i) {
      const bool back = a[i] < found_least[i] && a[i] <= b[i];
      const bool on = !back && b[i] < found_least[i];
      found_least[i] = back ? a[i] : on ? b[i] : found_least[i];
      found_best[i] = back ? before[i] : on ? after[i] : found_best[i];
    }
  }
  DistanceField::Values there;
  all.values(found_best, there);
  for (int i = 0; i < kBlock; ++i) {
    const FloatVec normal = SolidLine::unit({there.slope_x[i], there.slope_y[i], there.slope_z[i]});
    // Between the ends, a contact's normal is perpendicular to the line.
    const bool between = found_best[i] > 0 && found_best[i] < length;
    const FloatVec u = shape.along(i);
    const float slope = dot(normal, u);
    const FloatVec across =
        SolidLine::unit({normal.x - slope * u.x, normal.y - slope * u.y, normal.z - slope * u.z});
    const FloatVec n{between ? across.x : normal.x, between ? across.y : normal.y,
                     between ? across.z : normal.z};
    out.distance[i] = there.distance[i];
    out.cosine[i] = shape.cosine(i, n);
    out.along[i] = found_best[i];
    out.x[i] = n.x;
    out.y[i] = n.y;
    out.z[i] = n.z;
  }
}

inline void find_at_tip(const SolidLine& shape, Deepest& out) {
  const float tip[ShapeHypotheses::kBlock] = {};
  DistanceField::Values there;
  ChosenLines(shape).values(tip, there);
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
    const FloatVec n = SolidLine::unit({there.slope_x[i], there.slope_y[i], there.slope_z[i]});
    out.distance[i] = there.distance[i];
    out.cosine[i] = shape.cosine(i, n);
    out.along[i] = 0.0f;
    out.x[i] = n.x;
    out.y[i] = n.y;
    out.z[i] = n.z;
  }
}

// The class of lines for each stimulus.

/// Calls visit(std::type_identity<ShapeLine>()) with the class of the stimulus.
template <class Visit>
void visit_line_class(const ShapeHypotheses::Shape& shape, Visit&& visit) {
  if (shape.field) {
    std::forward<Visit>(visit)(std::type_identity<SolidLine>());
    return;
  }
  switch (shape.kind) {
    case stimuli::ShapeKind::cone:
      std::forward<Visit>(visit)(std::type_identity<AxialLine<ConeProfile>>());
      break;
    case stimuli::ShapeKind::cylinder:
      std::forward<Visit>(visit)(std::type_identity<AxialLine<CylinderProfile>>());
      break;
    case stimuli::ShapeKind::cube:
      std::forward<Visit>(visit)(std::type_identity<CubeLine>());
      break;
    case stimuli::ShapeKind::sphere:
      std::forward<Visit>(visit)(std::type_identity<SphereLine>());
      break;
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;  // these have a field
  }
}

}  // namespace palpate::runner::participants
