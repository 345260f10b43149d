#include "rendering/tool.h"

#include <algorithm>
#include <glm/gtc/quaternion.hpp>

namespace palpate::rendering {
namespace {

/// The world axis that is least aligned with `axis`.
Vec3 least_along(const Vec3& axis) {
  int least = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(axis[k]) < std::abs(axis[least])) least = k;
  }
  Vec3 out(0);
  out[least] = 1;
  return out;
}

/// `v` turned by the smallest rotation that turns the unit vector `from` into `to`.
Vec3 carried(const Vec3& v, const Vec3& from, const Vec3& to) {
  constexpr double kOpposite = 1e-9;
  const double cosine = glm::dot(from, to);
  if (!(1 + cosine > kOpposite)) return v;  // all half turns are equally small: about v
  const Vec3 axis = glm::cross(from, to);
  return v + glm::cross(axis, v) + glm::cross(axis, glm::cross(axis, v)) / (1 + cosine);
}

/// The unit vector of v's component at right angles to `axis`; false if that is almost zero.
bool perpendicular(const Vec3& v, const Vec3& axis, Vec3& out) {
  constexpr double kAlong = 1e-6;
  const Vec3 part = v - glm::dot(v, axis) * axis;
  const double length2 = glm::dot(part, part);
  if (!(length2 > kAlong * kAlong * glm::dot(v, v))) return false;
  out = part / std::sqrt(length2);
  return true;
}

/// Interpolates by the smallest rotation; the length changes linearly.
Vec3 turned_between(const Vec3& from, const Vec3& to, double fraction) {
  const double length = glm::length(from), other = glm::length(to);
  const Vec3 across = glm::cross(from, to);
  const double sine = glm::length(across);
  if (sine <= 1e-12 * length * other) return from + fraction * (to - from);
  const double angle = fraction * std::atan2(sine, glm::dot(from, to));
  const Vec3 u = from / length, v = glm::cross(across / sine, u);
  return (length + fraction * (other - length)) * (std::cos(angle) * u + std::sin(angle) * v);
}

}  // namespace

Mat3 tool_frame(const Vec3& d, const Mat3* before, const Vec3& measured) {
  const double length = glm::length(d);
  const Vec3 axis = length > 0 ? d / length : before != nullptr ? (*before)[2] : Vec3(0, 0, 1);
  Vec3 side;
  const bool sensed = perpendicular(measured, axis, side);
  if (!sensed &&
      !(before != nullptr && perpendicular(carried((*before)[0], (*before)[2], axis), axis, side)))
    perpendicular(least_along(axis), axis, side);
  return {side, glm::cross(axis, side), axis};
}

PlacedTool place(const Tool* tool, bool sides, const ToolPose& pose) {
  PlacedTool out;
  place(tool, sides, pose, out);
  return out;
}

void place(const Tool* tool, bool sides, const ToolPose& pose, PlacedTool& out) {
  out.count = tool == nullptr || !sides ? 1 : tool->segments.size();
  for (std::size_t j = 0; j < out.count; ++j) out.segments[j] = place_segment(tool, sides, pose, j);
}

ToolPose between(const ToolPose& from, const ToolPose& to, double fraction) {
  const Vec3 tip = from.tip + fraction * (to.tip - from.tip);
  if (from.frame == to.frame) return {tip, turned_between(from.d, to.d, fraction), to.frame};
  const Quat a = glm::quat_cast(from.frame), b = glm::quat_cast(to.frame);
  const Mat3 frame = glm::mat3_cast(glm::normalize(glm::slerp(a, b, fraction)));
  const double length = glm::length(from.d), change = glm::length(to.d) - length;
  return {tip, (length + fraction * change) * frame[2], frame};
}

double angle_between(const Tool* tool, const ToolPose& a, const ToolPose& b) {
  if (tool == nullptr) {
    return std::atan2(glm::length(glm::cross(a.d, b.d)), glm::dot(a.d, b.d));
  }
  double trace = 0, chord2 = 0;
  for (int k = 0; k < 3; ++k) {
    trace += glm::dot(a.frame[k], b.frame[k]);
    const Vec3 moved = a.frame[k] - b.frame[k];
    chord2 += glm::dot(moved, moved);
  }
  // |A - B|^2 = 4 (1 - cos), which is exact for small angles, where acos is not.
  return trace > 0 ? 2 * std::asin(std::min(1.0, std::sqrt(chord2 / 8)))
                   : std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0));
}

}  // namespace palpate::rendering
