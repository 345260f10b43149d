#pragma once
// A convex cell of space with what lies in it of a solid's surface, and its cutting by planes. SI
// units, the mesh's frame.

#include <cstdint>
#include <vector>

#include "stimuli/parts/planes.h"

namespace palpate::stimuli {

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

/// What a plane leaves of a cell on either side; one of them is empty where it does not cross.
struct CutCell {
  Cell below, above;
};

/// Cuts faces and surface. Ridges are left to the caller. A corner within the tolerance of the
/// plane is taken to lie on it and belongs to both sides, so volumes add up to rounding.
CutCell cut(Cell&& cell, std::uint32_t plane, const PlaneTable& planes);

}  // namespace palpate::stimuli
