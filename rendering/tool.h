#pragma once
// The tool on the stylus, rigidly joined segments that touch, and its pose.

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// One straight piece of a tool, in the frame of the stylus: origin at its tip, +z from tip to
/// tail. m. from == to: a point.
struct ToolSegment {
  Vec3 from, to;
};

/// The segments of a tool. They keep their lengths, whatever the distance from tip to tail. Empty:
/// the plain stylus, one segment from tip to tail.
struct Tool {
  static constexpr std::size_t kMostSegments = 16;
  std::vector<ToolSegment> segments;
};

/// The stylus and the frame of the tool on it, with its roll. World frame, m.
struct ToolPose {
  Vec3 tip;
  Vec3 d;                ///< tail - tip
  Mat3 frame = Mat3(1);  ///< columns: +x (the side), +y, +z (tip to tail); unused without a tool
};

/// A placed segment of the tool, m: from tip + from to tip + from + along.
struct PlacedSegment {
  Vec3 from, along;
};

/// The segments of an oriented tool, relative to the tip.
struct PlacedTool {
  std::array<PlacedSegment, Tool::kMostSegments> segments;
  std::size_t count = 0;
};

/// The frame of a tool whose stylus points along `d`.
/// \param d         tail - tip, m; zero keeps the direction of `before`
/// \param before    the frame at the last tick; null at first
/// \param measured  +x as the device senses it, any length; only its component at right angles to
/// the stylus counts. Zero: +x is carried along by the smallest rotation; at first it is the world
/// axis least aligned with the stylus
Mat3 tool_frame(const Vec3& d, const Mat3* before, const Vec3& measured);

/// \param tool   its segments; null: the stylus itself
/// \param sides  false: the tip alone touches
PlacedTool place(const Tool* tool, bool sides, const ToolPose& pose);

/// The same into an earlier result: writes only the segments that exist.
void place(const Tool* tool, bool sides, const ToolPose& pose, PlacedTool& out);

/// One of the segments.
inline PlacedSegment place_segment(const Tool* tool, bool sides, const ToolPose& pose,
                                   std::size_t index) {
  if (tool == nullptr || !sides) return {Vec3(0), sides ? pose.d : Vec3(0)};
  const ToolSegment& segment = tool->segments[index];
  return {pose.frame * segment.from, pose.frame * (segment.to - segment.from)};
}

/// A pose between two: the tip moves linearly; the stylus, with the tool if there is one, turns
/// about one axis. Its length changes linearly.
/// \param fraction  0: `from`, 1: `to`
ToolPose between(const ToolPose& from, const ToolPose& to, double fraction);

/// rad, between the orientations of two poses; includes the roll for a tool.
double angle_between(const Tool* tool, const ToolPose& a, const ToolPose& b);

}  // namespace palpate::rendering
