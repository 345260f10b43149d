#pragma once
// Objects of several convex parts, tools and paths for checks of contact with unions: closed forms
// (grooves, seams, steps), solids cut into pieces, random clusters. World frame, m.

#include <vector>

#include "data/base/random.h"
#include "rendering/verification/union_oracle.h"

namespace palpate::rendering {

using OracleParts = std::vector<OraclePart>;
using OracleTool = std::vector<OracleSegment>;

OraclePart part_of(const stimuli::PolygonSoup& soup);
OraclePart box_part(const Vec3& low, const Vec3& high);

/// Two prisms that abut in the plane x = 0 below their valley, the y axis. Its walls open upwards
/// by the angle `opening` (rad, below pi); 60 mm long, walls 60 mm wide.
OracleParts groove(double opening);
/// m, from a virtual tip to the ideal one that came into the groove from above, by projection on
/// the walls. Below the planes of both walls: to the valley.
Vec3 groove_displacement(double opening, const Vec3& virtual_tip);

/// Steps that go down towards +x, each `width` wide and `height` high, the edge of the uppermost at
/// x = 0, z = 0; each step is one box down to the floor.
OracleParts stairs(int steps, double width, double height);

/// The pieces of a solid cut by random planes near its middle; they abut exactly up to rounding.
OracleParts cut_to_pieces(const stimuli::PolygonSoup& solid, int cuts, Random& random);

/// Boxes, prisms, icospheres, cones and cylinders of 10 to 50 mm that overlap; some turned at
/// random, some along the axes and abutting exactly.
OracleParts random_cluster(Random& random, int parts);

/// The first segment runs 20 to 120 mm from the tip along +z. Each further one runs 10 to 50 mm in
/// any direction from an end of an earlier one.
OracleTool random_tool(Random& random, int segments);

/// A hand that leads some point of the tool from place to place around and through the object, at
/// `speed` (m per tick), and turns it. Starts outside, at least 2 mm off.
std::vector<OraclePose> random_tool_path(Random& random, const OracleParts& parts,
                                         const OracleTool& tool, double speed, std::size_t ticks);

}  // namespace palpate::rendering
