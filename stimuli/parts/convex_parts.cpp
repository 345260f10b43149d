#include "stimuli/parts/convex_parts.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "stimuli/half_edges.h"
#include "stimuli/parts/convex_parts_groups.h"
#include "stimuli/parts/cover_check.h"
#include "stimuli/parts/cutting.h"
#include "stimuli/parts/merging.h"
#include "stimuli/primitives.h"
#include "stimuli/weld.h"

namespace palpate::stimuli {
namespace {

// m, of the coordinates' error: facets are taken for plane within 8 errors, and a corner must not
// lie on one of two facets that meet in it and miss the other.
constexpr double kErrors = 16;

// Neighbouring parts get the same corners, to the bit, those of the solid where there are some.
std::vector<PolygonSoup> soups_of(const std::vector<std::vector<CellPolygon>>& parts,
                                  const FacetedSolid& solid, double tolerance) {
  std::vector<Vec3> points = solid.points;
  for (const auto& faces : parts) {
    for (const CellPolygon& face : faces)
      points.insert(points.end(), face.corners.begin(), face.corners.end());
  }
  const std::vector<std::uint32_t> kept = weld(points, tolerance);
  std::size_t next = solid.points.size();
  std::vector<PolygonSoup> soups;
  for (const auto& faces : parts) {
    PolygonSoup soup;
    soup.coordinate_error = solid.error;
    soup.names = std::make_shared<const MeshNames>();  // its numbers are nobody's
    for (const CellPolygon& face : faces) {
      std::vector<std::uint32_t> polygon;
      for (std::size_t k = 0; k < face.corners.size(); ++k) {
        polygon.push_back(static_cast<std::uint32_t>(soup.vertices.size()));
        soup.vertices.push_back(points[kept[next++]]);
      }
      soup.faces.push_back(std::move(polygon));
    }
    soups.push_back(std::move(soup));
  }
  return soups;
}

void check_inside_out(const FacetedSolid& solid, MeshFaults& faults) {
  const SolidBulk bulk = bulk_of(solid.triangles);
  if (bulk.volume > 2 * solid.error * bulk.area) return;
  if (bulk.volume < -2 * solid.error * bulk.area) {
    faults.add("inside out", [] {
      return "all faces are clockwise seen from outside; expected counter-clockwise";
    });
  } else {
    faults.add("flat", [] { return "expected a solid, found no volume"; });
  }
}

std::vector<ConvexMesh> one_part(const PolygonSoup& soup) {
  try {
    std::vector<ConvexMesh> one;
    one.emplace_back(soup);
    return one;
  } catch (const MeshError&) {
    return cut_into_convex_parts(soup);
  }
}

}  // namespace

std::vector<ConvexMesh> cut_into_convex_parts(const PolygonSoup& soup) {
  MeshFaults faults;
  const HalfEdges mesh = link_half_edges(soup, faults, Pieces::any);
  faults.throw_if_any();
  PlaneTable planes(kErrors * mesh.error);
  const FacetedSolid solid = faceted_solid(mesh, planes, faults);
  faults.throw_if_any();
  check_inside_out(solid, faults);
  faults.throw_if_any();
  std::vector<std::vector<CellPolygon>> cells = cut_at_concave_edges(solid, planes, faults);
  faults.throw_if_any();
  merge_convex_neighbours(cells, planes);
  std::vector<ConvexMesh> parts;
  for (const PolygonSoup& part : soups_of(cells, solid, 2 * planes.tolerance())) {
    try {
      parts.emplace_back(part);
    } catch (const MeshError& error) {
      faults.add("not convex", [&] {
        return "part " + std::to_string(parts.size() + 1) +
               " of what it was cut into is no convex mesh: " + error.faults()[0];
      });
    }
  }
  faults.throw_if_any();
  check_cover(solid.triangles, parts, kErrors * soup.coordinate_error, faults);
  faults.throw_if_any();
  return parts;
}

std::vector<ConvexMesh> convex_parts(const PolygonSoup& soup) {
  std::vector<ConvexMesh> parts;
  try {
    parts.emplace_back(soup);
    return parts;
  } catch (const MeshError&) {
    // Not convex, or broken: what follows says so.
  }
  const std::vector<SolidGroup> groups = solid_groups(soup);
  if (groups.empty()) return cut_into_convex_parts(soup);
  std::vector<std::string> faults;
  for (const SolidGroup& group : groups) {
    try {
      for (ConvexMesh& part : one_part(group.soup)) parts.push_back(std::move(part));
    } catch (const MeshError& error) {
      for (const std::string& fault : error.faults()) faults.push_back(group.name + ": " + fault);
    }
  }
  if (!faults.empty()) throw MeshError(std::move(faults));
  return parts;
}

std::optional<std::vector<ConvexMesh>> convex_as_it_is(const PolygonSoup& soup) {
  std::vector<ConvexMesh> parts;
  try {
    parts.emplace_back(soup);
    return parts;
  } catch (const MeshError&) {
    // It is not convex as a whole.
  }
  try {
    for (const SolidGroup& group : solid_groups(soup)) parts.emplace_back(group.soup);
  } catch (const MeshError&) {
    return std::nullopt;
  }
  if (parts.empty()) return std::nullopt;
  return parts;
}

std::vector<ConvexMesh> convex_parts(const ObjectSpec& spec) {
  const PolygonSoup soup = polygons_of(spec);
  if (spec.shape == ShapeKind::mesh) return convex_parts(soup);
  std::vector<ConvexMesh> one;
  one.emplace_back(soup);
  return one;
}

}  // namespace palpate::stimuli
