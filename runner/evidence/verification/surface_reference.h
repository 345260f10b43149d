#pragma once
// Brute-force reference of contact with closed surfaces: the ideal tool by its definition, a
// nearest place outside the solid that the tool reaches from its last one. Looks at every triangle
// and edge near the tool, by distance alone. Shares no code with the contact law, its searches and
// trees. For checks, not for the servo. World frame, SI units.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::evidence {

/// Triangles of one or more closed shells, outward; shells may overlap.
struct ReferenceTriangle {
  std::array<Vec3, 3> corners;  ///< m, counter-clockwise seen from outside
  double stiffness = 0;         ///< N/m
  int shell = 0;                ///< triangles of one shell share their edges
};

/// A segment of the tool, relative to its tip; equal ends: a point.
struct ReferenceSegment {
  Vec3 from, to;  ///< m
};

/// The virtual tool at a tick.
struct ReferenceTool {
  Vec3 tip;                                ///< m
  std::span<const ReferenceSegment> rods;  ///< at its present orientation
};

struct ReferenceTick {
  bool touching = false;
  /// Whether the reference knows the answer: the search ended, and the tool moved little enough. A
  /// tool that jams as it turns has no answer here until it has been outside again.
  bool known = true;
  Vec3 shift{0};   ///< m, from the virtual to the ideal tip
  Vec3 force{0};   ///< N, on the hand
  Vec3 torque{0};  ///< N m, about the virtual tip
  /// No rod lies within 2 degrees of a face that it touches. Else the place of contact, and so the
  /// torque, is a convention (equation (2)).
  bool torque_defined = true;
};

/// One ideal tool and the solid that it may not enter.
class SurfaceReference {
 public:
  explicit SurfaceReference(std::span<const ReferenceTriangle> triangles);

  /// Moves the ideal tool. The first tick, and those after it until the tool has been outside once,
  /// give no force.
  ReferenceTick tick(const ReferenceTool& virtual_tool);
  /// Where the ideal tip is, m.
  const Vec3& ideal_tip() const { return tip_; }

  /// How often the surfaces wind round a point (van Oosterom & Strackee 1983).
  double winding(const Vec3& point) const;
  /// Whether an end of a rod, or one of 32 places along it, is in the solid.
  bool inside(const ReferenceTool& tool) const;
  double size() const { return size_; }  ///< m, diagonal of the box
  Vec3 low() const { return low_; }      ///< m, corner of the box
  Vec3 high() const { return high_; }    ///< m

 private:
  struct Face {
    std::array<Vec3, 3> corners;
    std::array<Vec3, 3> inward;  ///< unit, of each side, in the plane
    std::array<bool, 3> convex;  ///< the solid's edge at that side
    Vec3 normal, centre;
    double radius = 0, stiffness = 0;
  };
  /// A convex edge.
  struct Ridge {
    Vec3 from, to, left, right;  ///< left, right: normals of its faces
    bool ends[2];                ///< whether it stops there: only convex edges meet in that corner
    Vec3 centre;
    double radius = 0, stiffness = 0;
  };
  /// A bound of the tip: dot(normal, tip) >= offset, while the tip is near.
  struct Bound {
    Vec3 normal;
    double offset = 0, stiffness = 0;
    std::size_t rod = 0;
    double along = 0;  ///< share of the rod at which it touches
    bool flat = false;
  };
  struct Near {
    std::vector<std::uint32_t> faces, ridges;
    std::vector<ReferenceSegment> rods;
    Vec3 tip;
    double room = 0;
    bool filled = false;
  };

  void find_ridges(std::span<const ReferenceTriangle> triangles);
  void list_near(std::span<const ReferenceSegment> rods);
  bool far_from(const Near& near, std::span<const ReferenceSegment> rods, double reach) const;
  void collect(std::span<const ReferenceSegment> rods, double beyond);
  void collect_ends(const Face& face, const ReferenceSegment& rod, std::size_t index,
                    double beyond);
  void collect_ridge(const Ridge& ridge, const ReferenceSegment& rod, std::size_t index,
                     double beyond);
  enum class Descent {
    ended,
    under_way,
    stuck  ///< nothing is above all bounds: turning jams the tool
  };
  /// Descends towards the virtual tip by at most so many steps.
  Descent descend(const Vec3& goal, std::span<const ReferenceSegment> rods, int most);
  bool nearest(const Vec3& goal, Vec3& place);

  std::vector<Face> faces_;
  std::vector<Ridge> ridges_;
  Vec3 low_, high_;
  double size_ = 0, step_ = 0, band_ = 0, skin_ = 0;

  Near wide_, close_;
  std::vector<Bound> bounds_;
  std::vector<std::size_t> held_;    ///< indices of bounds that carry
  std::vector<double> multipliers_;  ///< m, of held_
  std::vector<ReferenceSegment> last_rods_;
  Vec3 tip_, last_tip_;
  std::size_t grasp_rod_ = 0;
  double grasp_along_ = 0;
  bool started_ = false, left_ = false, touching_ = false;
  bool lost_ = false;  ///< the answer is unknown until the tool has been outside
};

}  // namespace palpate::runner::evidence
