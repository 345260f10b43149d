#pragma once
// What the stylus carries: segments that touch, rigidly joined.

#include <cstddef>
#include <vector>

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

}  // namespace palpate::rendering
