#pragma once
// Brute-force oracle of contact between a rigid tool of line segments and an object that is a union
// of convex parts: for a fixed orientation the tool is one point, its tip, outside every Minkowski
// sum M_ij = C_i (+) (-S_j) of part i and mirrored segment j. All half-spaces of all sums are
// written out at every tick; the point descends to the virtual tip by steepest descent in the free
// space. Independent of the contact law, the walk and the trees: it shares only the mesh with them.
// For checks, not for the servo. World frame and SI units unless said otherwise.

#include <memory>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

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

}  // namespace palpate::rendering
