#pragma once
// Whether a drawn object stays on the participant's screen.

#include <string>
#include <vector>

#include "protocols/sight.h"
#include "runner/workspace_map.h"

namespace palpate::runner {

/// Where an object is felt: points of its surface or about it, each with a ball of `radius` about
/// it that may be drawn as well. Virtual frame, m.
struct DrawnBounds {
  Vec3 origin{0};  ///< of the object
  std::vector<Vec3> points;
  double radius = 0;
};

/// "leaves the screen at its upper edge, by 0.012 m at the object", for the edge that it leaves
/// most; empty: it stays on the screen. Counts three standard deviations of the noise.
std::string off_screen(const protocols::ViewSpec& view, const WorkspaceMap& workspace,
                       const protocols::SeenSpec& seen, const DrawnBounds& bounds);

}  // namespace palpate::runner
