#pragma once
// What the stylus carries, as the console's view draws it. Virtual frame, m.

#include <vector>

#include "rendering/tool.h"
#include "runner/servo/sample.h"

namespace palpate::runner {

/// The segments of the tool, as one of them is drawn: in the hand or as the ideal tool.
struct DrawnTool {
  rendering::LineProbe stylus;
  std::vector<rendering::LineProbe> segments;  ///< without a tool the stylus alone
};

/// The tool in the hand: where the stylus is, with the roll of the ideal tool (they differ by its
/// lag alone).
DrawnTool tool_in_hand(const rendering::Tool& tool, const Sample& sample);

/// The ideal tool of the deepest contact; in free space where the hand is.
DrawnTool ideal_tool(const rendering::Tool& tool, const Sample& sample);

}  // namespace palpate::runner
