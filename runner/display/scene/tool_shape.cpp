#include "runner/display/scene/tool_shape.h"

#include "rendering/tool.h"

namespace palpate::runner {
namespace {

/// \param side  +x of the tool; zero: as at the beginning of a trial
DrawnTool placed(const rendering::Tool& tool, const rendering::LineProbe& stylus,
                 const Vec3& side) {
  DrawnTool out{stylus, {}};
  if (tool.segments.empty()) {
    out.segments = {stylus};
    return out;
  }
  const Vec3 d = stylus.tail - stylus.tip;
  const Mat3 frame = rendering::tool_frame(d, nullptr, side);
  for (const rendering::ToolSegment& segment : tool.segments)
    out.segments.push_back({stylus.tip + frame * segment.from, stylus.tip + frame * segment.to});
  return out;
}

}  // namespace

DrawnTool tool_in_hand(const rendering::Tool& tool, const Sample& sample) {
  return placed(tool, sample.probe, sample.rendering.ideal_side);
}

DrawnTool ideal_tool(const rendering::Tool& tool, const Sample& sample) {
  if (sample.rendering.contacts == 0) return tool_in_hand(tool, sample);
  return placed(tool, sample.rendering.ideal, sample.rendering.ideal_side);
}

}  // namespace palpate::runner
