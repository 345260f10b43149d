#pragma once
// Objects of several convex parts, tools and paths for checks of contact with unions: closed forms
// (grooves, seams, steps), solids cut into pieces, random clusters. World frame, m.
//
// And the brute-force oracle of contact between a rigid tool of line segments and an object that is
// a union of convex parts: for a fixed orientation the tool is one point, its tip, outside every
// Minkowski sum M_ij = C_i (+) (-S_j) of part i and mirrored segment j. All half-spaces of all sums
// are written out at every tick; the point descends to the virtual tip by steepest descent in the
// free space. Independent of the contact law, the walk and the trees: it shares only the mesh with
// them. For checks, not for the servo. World frame and SI units unless said otherwise.

#include <memory>
#include <vector>

#include "data/base/random.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// A convex part of the object.
struct OraclePart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  Pose pose;
};

/// A segment of the tool in the tool's frame (origin at the tip, +z from tip to tail), m.
struct OracleSegment {
  Vec3 from, to;
};

/// The pose of the tool.
struct OraclePose {
  Vec3 tip;      ///< m
  Mat3 axes{1};  ///< rotation from the tool's frame

  Vec3 place(const Vec3& in_tool) const { return tip + axes * in_tool; }
};

/// A half-space that holds a sum: dot(normal, x) <= offset.
struct OraclePlane {
  Vec3 normal;  ///< unit, out of the sum
  double offset = 0;

  double height(const Vec3& x) const;  ///< m, above the plane
};

/// M_ij at one orientation: the tips with which segment and part overlap.
struct OracleSum {
  int part = 0, segment = 0;
  std::vector<OraclePlane> planes;

  double height(const Vec3& tip) const;  ///< of the highest plane, m; negative inside
};

/// One plane that pushes the ideal tool away from the virtual one.
struct OracleContact {
  int part = 0, segment = 0;
  Vec3 normal;
  double share = 0;  ///< m: the displacement of the ideal tool is the sum of share * normal
  /// m, along the segment from its first end: the portion that touches the part; equal if it
  /// touches at a point
  double first = 0, last = 0;
};

struct OracleTick {
  OraclePose ideal;
  std::vector<OracleContact> contacts;
  /// Every touched sum carries a share and is touched on one facet: the displacement splits in one
  /// way only.
  bool unique_shares = true;
  bool lagged = false;  ///< the ideal tool could not take the whole turn
  bool failed = false;  ///< no descent ended within the limit of rounds: `ideal` is invalid
  int rounds = 0;
};

/// Deviations of an ideal tool from the definition. Lengths in m, all 0 where it complies.
struct OracleAudit {
  double penetration = 0;  ///< the greatest depth of the ideal tip in a sum
  /// The residual of the displacement after non-negative multiples of the normals of touched
  /// facets.
  double unbalanced = 0;
  /// The next move of steepest descent: 0 at a local minimum of the distance from the virtual tip.
  /// Exactly on an edge, a tool held by one facet may slide off along the other: there it is not 0,
  /// although nothing is unbalanced.
  double descent = 0;
};

class UnionOracle {
 public:
  UnionOracle(const std::vector<OraclePart>& parts, std::vector<OracleSegment> tool);

  /// Every M_ij at this orientation of the tool.
  std::vector<OracleSum> sums(const Mat3& axes) const;
  /// m, of the tool in the part that it is deepest in, to the nearest facet of the sum; negative
  /// outside all.
  double depth(const OraclePose& tool) const;
  /// From an ideal tool outside all parts: turns it towards the orientation of the virtual one as
  /// far as possible, then descends.
  OracleTick tick(const OraclePose& last_ideal, const OraclePose& virtual_tool) const;
  /// \param touching  m; sums no further away count as touched
  OracleAudit audit(const OraclePose& ideal, const Vec3& virtual_tip, double touching) const;
  /// Whether facets within `touching` (m) hold the ideal tool if a groove of opposite facets may
  /// clamp it with any leverage above rounding.
  /// \param least  m; a smaller residual counts as balanced
  bool held_in_gap(const OraclePose& ideal, const Vec3& virtual_tip, double touching,
                   double least) const;

  double size() const { return size_; }            ///< m, of the largest part
  double thickness() const { return thickness_; }  ///< m, least width of the thinnest part
  double reach() const { return reach_; }          ///< m, of the tool from its tip

 private:
  struct Solid {  // a part in the world frame
    std::vector<OraclePlane> planes;
    struct Edge {
      Vec3 from, to;
      std::size_t left, right;  // planes
    };
    std::vector<Edge> edges;
  };

  bool turn(OraclePose& ideal, const Mat3& to) const;
  /// Sets first and last: the portion of the segment that lies in the part, within rounding.
  void touching_portion(const OraclePose& ideal, OracleContact& contact) const;

  std::vector<Solid> solids_;
  std::vector<OracleSegment> tool_;
  double size_ = 0, thickness_ = 0, reach_ = 0;
  double touch_ = 0;  // m; rounding at this size and distance counts as touching
};

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

}  // namespace palpate::runner::evidence
