#pragma once
// A convex cell of space with the piece of a solid's surface in it, and its cutting by planes. SI
// units, the mesh's frame.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

// The planes that a solid is cut by: equal planes have one number.

struct Plane {
  Vec3 normal;        ///< unit
  double offset = 0;  ///< m; dot(normal, p) == offset

  double height(const Vec3& point) const {
    return normal.x * point.x + normal.y * point.y + normal.z * point.z - offset;
  }
};

/// A plane of the table, seen from one of its sides.
struct PlaneSide {
  std::uint32_t plane = 0;
  bool flipped = false;  ///< the outward normal is the plane's, turned round
};

class PlaneTable {
 public:
  /// \param tolerance  m; points nearer than this are on a plane
  explicit PlaneTable(double tolerance) : tolerance_(tolerance) {}

  double tolerance() const { return tolerance_; }
  const Plane& operator[](std::uint32_t plane) const { return planes_[plane]; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(planes_.size()); }

  /// A plane of the table that all points lie on, or `plane`, which is added. Points must span it.
  PlaneSide number(const Plane& plane, std::span<const Vec3> points);

 private:
  double tolerance_;
  std::vector<Plane> planes_;
};

/// A plane convex polygon, counter-clockwise seen from outside.
struct CellPolygon {
  std::vector<Vec3> corners;  ///< m
  PlaneSide on;
};

/// A concave edge of the solid, or the piece of it in a cell.
struct Ridge {
  Vec3 from, to;           ///< m
  std::uint32_t edge = 0;  ///< its number in the list of concave edges
};

struct Cell {
  std::vector<CellPolygon> faces;    ///< the closed surface of the cell itself
  std::vector<CellPolygon> surface;  ///< of the solid, in the cell and not on its faces
  std::vector<Ridge> ridges;         ///< concave edges that are not cut apart yet

  bool empty() const { return faces.empty(); }
};

struct CellBulk {
  double volume = 0;  ///< m^3
  double area = 0;    ///< m^2
  Vec3 middle;        ///< m, mean of the corners of the faces
};
CellBulk bulk_of(const std::vector<CellPolygon>& faces);

/// An axis-aligned box. Adds its planes to the table.
Cell box_cell(const Vec3& low, const Vec3& high, PlaneTable& planes);

/// The two sides of a cut cell; one is empty where the plane does not cross the cell.
struct CutCell {
  Cell below, above;
};

/// Cuts faces and surface. Ridges are left to the caller. A corner within the tolerance of the
/// plane is taken to lie on it and belongs to both sides, so volumes add up to rounding.
CutCell cut(Cell&& cell, std::uint32_t plane, const PlaneTable& planes);

// A closed polyhedral surface as triangles: its volume, and how often it winds round a point.

/// Closed; triangles counter-clockwise seen from outside. m.
using TriangleSurface = std::vector<std::array<Vec3, 3>>;

struct SolidBulk {
  double volume = 0;  ///< m^3, by the divergence theorem; negative: inside out
  double area = 0;    ///< m^2
};
SolidBulk bulk_of(const TriangleSurface& surface);

/// 0 outside, 1 inside a simple solid; near an integer anywhere but on the surface. Sum of the
/// triangles' signed solid angles (van Oosterom & Strackee 1983), so its cost is their number.
double winding_number(const TriangleSurface& surface, const Vec3& point);

}  // namespace palpate::stimuli
