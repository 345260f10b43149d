#pragma once
// Signed distances of cylinder and cone in the half-plane (radius, height), branch-free.

#include <cmath>

#include "runner/participants/lane_math.h"
#include "runner/participants/shape_hypotheses.h"

namespace palpate::runner::participants {

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

}  // namespace palpate::runner::participants
