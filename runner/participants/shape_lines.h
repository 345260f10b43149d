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
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

// Signed distances of cylinder and cone in the half-plane (radius, height), branch-free.

/// A vector in the half-plane of a solid of revolution.
struct ProfileVec {
  float radial, axial;
};

class CylinderProfile {
 public:
  explicit CylinderProfile(const ShapeHypotheses::Shape& shape)
      : radius_(shape.radius), half_(shape.half_size) {}

  float distance(float radius, float height) const {
    const float side = radius - radius_;
    const float end = std::fabs(height) - half_;
    const float x = lane::positive(side);
    const float y = lane::positive(end);
    return std::sqrt(x * x + y * y) + lane::min(lane::max(side, end), 0.0f);
  }
  /// Along the outward normal, of arbitrary positive length.
  ProfileVec outward(float radius, float height) const {
    const float side = radius - radius_;
    const float end = std::fabs(height) - half_;
    const float most = lane::max(side, end);
    const bool outside = most > 0.0f;
    const float x = outside ? lane::positive(side) : (side < most ? 0.0f : 1.0f);
    const float y = outside ? lane::positive(end) : (end < most ? 0.0f : 1.0f);
    return {x, y * lane::sign(height)};
  }

 private:
  float radius_, half_;
};

/// Apex at +half_size, base at -half_size.
class ConeProfile {
 public:
  explicit ConeProfile(const ShapeHypotheses::Shape& shape)
      : radius_(shape.radius), half_(shape.half_size) {
    const float height = 2.0f * half_;
    side_ = std::sqrt(radius_ * radius_ + height * height);
    normal_ = {height / side_, radius_ / side_};
    up_ = {-radius_ / side_, height / side_};
  }

  float distance(float radius, float height) const {
    const Offsets o = offsets(radius, height);
    const float inside = lane::max(o.side, o.base);
    const float outside = std::sqrt(lane::min(o.to_side(), o.to_base()));
    return inside > 0.0f ? outside : inside;
  }
  ProfileVec outward(float radius, float height) const {
    const Offsets o = offsets(radius, height);
    const bool outside = lane::max(o.side, o.base) > 0.0f;
    // Outside: from the nearest point of slant or base, whichever is nearer. Inside: the normal of
    // the nearer face; the offsets past its ends are zero there.
    const float preference = outside ? o.to_base() - o.to_side() : o.side - o.base;
    const float off_side = outside ? o.side : 1.0f;
    const float off_base = outside ? o.base : 1.0f;
    const ProfileVec from_side{o.past_side * up_.radial + off_side * normal_.radial,
                               o.past_side * up_.axial + off_side * normal_.axial};
    const bool side = preference >= 0.0f;
    return {side ? from_side.radial : o.past_base, side ? from_side.axial : -off_base};
  }

 private:
  struct Offsets {
    float side, past_side;  // m: off the slant, and beyond its ends along it
    float base, past_base;  // m: below the base, and beyond its rim along it
    float to_side() const { return side * side + past_side * past_side; }
    float to_base() const { return base * base + past_base * past_base; }
  };
  Offsets offsets(float radius, float height) const {
    const float x = radius - radius_;
    const float z = height + half_;
    const float climb = up_.radial * x + up_.axial * z;
    return {normal_.radial * x + normal_.axial * z, climb - lane::clamp(climb, 0.0f, side_), -z,
            lane::positive(x)};
  }

  float radius_, half_, side_;
  ProfileVec normal_, up_;
};

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

/// Lines in the stimulus' frame, side by side.
template <int kRoom>
struct LineRows {
  float start[3][kRoom], along[3][kRoom], direction[3][kRoom];
};

/// A line in the frames of kBlock rotations of one stimulus.
class RotatedLine {
 public:
  RotatedLine(const ShapeHypotheses& hypotheses, int first, const Line& line)
      : hypotheses_(&hypotheses), first_(first) {
    for (int a = 0; a < 3; ++a) {
      const float* x = hypotheses.nearby_component(a, 0) + first;
      const float* y = hypotheses.nearby_component(a, 1) + first;
      const float* z = hypotheses.nearby_component(a, 2) + first;
      for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
        const FloatVec axis{x[i], y[i], z[i]};
        rows_.start[a][i] = dot(axis, line.start);
        rows_.along[a][i] = dot(axis, line.along);
        rows_.direction[a][i] = dot(axis, line.direction);
      }
    }
  }

  FloatVec along(int i) const { return {rows_.along[0][i], rows_.along[1][i], rows_.along[2][i]}; }
  float cosine(int i, const FloatVec& v) const {
    return v.x * rows_.direction[0][i] + v.y * rows_.direction[1][i] + v.z * rows_.direction[2][i];
  }
  FloatVec world(int i, const FloatVec& v) const {
    const auto component = [&](int c) {
      return v.x * hypotheses_->nearby_component(0, c)[first_ + i] +
             v.y * hypotheses_->nearby_component(1, c)[first_ + i] +
             v.z * hypotheses_->nearby_component(2, c)[first_ + i];
    };
    return {component(0), component(1), component(2)};
  }

 protected:
  FloatVec at(int i, float s) const {
    return {rows_.start[0][i] + s * rows_.along[0][i], rows_.start[1][i] + s * rows_.along[1][i],
            rows_.start[2][i] + s * rows_.along[2][i]};
  }

  LineRows<ShapeHypotheses::kBlock> rows_;

 private:
  const ShapeHypotheses* hypotheses_;
  int first_;
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

/// \param count  as many hypotheses as are needed, if not all; the others may be left out
template <class ShapeLine>
void find_at_tip(const ShapeLine& shape, Deepest& out, int /*count*/ = ShapeHypotheses::kBlock) {
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
void find_along_line(const ShapeLine& shape, float length, Deepest& out,
                     int /*count*/ = ShapeHypotheses::kBlock) {
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

// Signed distances of hypotheses along one line, for stimuli without a formula.

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

/// One block of hypotheses. Has the functions of the other classes of this file.
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

/// At the place along[i] of the first `count` lines.
inline void find_surface(const SolidLine& shape, float length, Deepest& out, int count) {
  for (int i = 0; i < count; i += lane::kWidth) {
    const LanesOfSurface there =
        surface_at(LanesOfLines(shape.field(), shape.rows(), i), lane::load(out.along + i), length);
    const auto& [x, y, z] = shape.rows().direction;
    const LanesOfVectors direction{lane::load(x + i), lane::load(y + i), lane::load(z + i)};
    lane::store(there.distance, out.distance + i);
    lane::store(dot(there.normal, direction), out.cosine + i);
    lane::store(there.normal.x, out.x + i);
    lane::store(there.normal.y, out.y + i);
    lane::store(there.normal.z, out.z + i);
  }
}

inline void find_along_line(const SolidLine& shape, float length, Deepest& out,
                            int count = ShapeHypotheses::kBlock) {
  float least[ShapeHypotheses::kBlock];
  search_lines(shape.field(), shape.rows(), count, length, out.along, least);
  find_surface(shape, length, out, count);
}

inline void find_at_tip(const SolidLine& shape, Deepest& out, int count = ShapeHypotheses::kBlock) {
  std::fill_n(out.along, ShapeHypotheses::kBlock, 0.0F);
  find_surface(shape, 0, out, count);
}

/// The class of lines for each stimulus.
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
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;  // these have a field
  }
}

}  // namespace palpate::runner::participants
