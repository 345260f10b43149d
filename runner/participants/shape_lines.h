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

#include "runner/participants/lane_math.h"
#include "runner/participants/shape_hypotheses.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

/// A vector in the half-plane (radius, height) of a solid of revolution.
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

}  // namespace palpate::runner::participants
