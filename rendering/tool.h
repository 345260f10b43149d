#pragma once
// What the stylus carries: segments that touch, rigidly joined; and its pose.

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

/// The segments of a tool, which keep their lengths whatever the distance of tip and tail. Empty:
/// the plain stylus, one segment from tip to tail.
struct Tool {
  static constexpr std::size_t kMostSegments = 16;
  std::vector<ToolSegment> segments;
};

// Where a tool is: the stylus that carries it, with its roll. World frame, m.

/// The stylus and the frame of what it carries.
struct ToolPose {
  Vec3 tip;
  Vec3 d;                ///< tail - tip
  Mat3 frame = Mat3(1);  ///< columns: +x (the side), +y, +z (tip to tail); without a tool unused
};

/// A segment of the tool as it stands: from tip + from to tip + from + along.
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
/// \param measured  +x as the device senses it, any length; only what is at right angles to the
/// stylus counts; zero: +x is carried along by the smallest rotation, and at first it is the world
/// axis least along the stylus
Mat3 tool_frame(const Vec3& d, const Mat3* before, const Vec3& measured);

/// \param tool   its segments; null: the stylus itself
/// \param sides  false: the tip alone touches
PlacedTool place(const Tool* tool, bool sides, const ToolPose& pose);

/// The same over what was placed before: writes no more than the segments that there are.
void place(const Tool* tool, bool sides, const ToolPose& pose, PlacedTool& out);

/// One of them.
PlacedSegment place_segment(const Tool* tool, bool sides, const ToolPose& pose, std::size_t index);

/// A pose between two: the tip moves linearly; the stylus turns about one axis, with the tool where
/// there is one. Its length changes in proportion.
/// \param fraction  0: `from`, 1: `to`
ToolPose between(const ToolPose& from, const ToolPose& to, double fraction);

/// rad, between the orientations of two poses, with the roll for a tool.
double angle_between(const Tool* tool, const ToolPose& a, const ToolPose& b);

}  // namespace palpate::rendering
