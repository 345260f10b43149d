#include "stimuli/parts/convex_parts.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "stimuli/convex_mesh.h"
#include "stimuli/face_triangles.h"
#include "stimuli/half_edges.h"
#include "stimuli/mesh_names.h"
#include "stimuli/parts/triangle_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

/// Takes some faces of a soup out, with the vertices that they use.
class Subsets {
 public:
  explicit Subsets(const PolygonSoup& soup) : soup_(soup), number_(soup.vertices.size()) {}

  PolygonSoup of(const std::vector<Index>& faces) {
    PolygonSoup some;
    some.coordinate_error = soup_.coordinate_error;
    vertices_.clear();
    for (const Index f : faces)
      vertices_.insert(vertices_.end(), soup_.faces[f].begin(), soup_.faces[f].end());
    std::sort(vertices_.begin(), vertices_.end());
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    for (Index i = 0; i < vertices_.size(); ++i) {
      number_[vertices_[i]] = i;
      some.vertices.push_back(soup_.vertices[vertices_[i]]);
    }
    for (const Index f : faces) {
      std::vector<Index>& face = some.faces.emplace_back();
      for (const Index v : soup_.faces[f]) face.push_back(number_[v]);
    }
    some.names = std::make_shared<const MeshNames>(names_of(faces));
    return some;
  }

 private:
  MeshNames names_of(const std::vector<Index>& faces) const {
    if (soup_.names) return soup_.names->subset(vertices_, faces);
    MeshNames names;
    for (const Index v : vertices_) names.vertices.push_back({v, 0});
    for (const Index f : faces) names.faces.push_back({f, 0});
    return names;
  }

  const PolygonSoup& soup_;
  std::vector<Index> vertices_;  // of the subset under construction
  std::vector<Index> number_;    // the subset's number of each vertex
};

bool is_closed(const PolygonSoup& soup) {
  MeshFaults faults;
  link_half_edges(soup, faults, Pieces::any);
  return faults.empty();
}

TriangleSurface triangles_of(const PolygonSoup& soup) {
  TriangleSurface triangles;
  for (const auto& face : soup.faces) {
    for (std::size_t k = 2; k < face.size(); ++k)
      triangles.push_back(
          {soup.vertices[face[0]], soup.vertices[face[k - 1]], soup.vertices[face[k]]});
  }
  return triangles;
}

/// Whether a corner stands so far above a face that no rounding of coordinates explains it. Looks
/// at some faces and corners of a large mesh: to link all its edges takes a second at a million
/// faces.
bool is_plainly_concave(const PolygonSoup& soup) {
  constexpr std::size_t kLarge = 50'000, kSeen = 1024, kCorners = 16'384;
  constexpr Index kNone = 0xffffffff;
  constexpr double kOfSize = 2e-3, kOfTilt = 1000;  // of the size; of what rounding tilts a face by
  if (soup.faces.size() < kLarge || soup.group_names.size() > 1) return false;
  std::vector<PolygonPlane> planes;
  for (std::size_t i = 0; i < kSeen; ++i) {
    std::vector<Vec3> corners;
    for (const Index v : soup.faces[i * soup.faces.size() / kSeen]) {
      if (v >= soup.vertices.size()) return false;
      corners.push_back(soup.vertices[v]);
    }
    if (corners.size() >= 3) planes.push_back(plane_of(corners));
  }
  const auto width = [](const PolygonPlane& plane) {
    const double mean = plane.area / plane.diameter;
    return mean > 0 ? mean : 0;  // not a number: there is no such plane
  };
  std::vector<Vec3> corners;  // of faces: others do not count
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (std::size_t i = 0; i < soup.faces.size(); i += 1 + soup.faces.size() / kCorners) {
    const Index v = soup.faces[i].empty() ? kNone : soup.faces[i][0];
    if (v >= soup.vertices.size()) return false;
    corners.push_back(soup.vertices[v]);
    low = glm::min(low, corners.back());
    high = glm::max(high, corners.back());
  }
  const double size = glm::length(high - low);
  const double error =
      std::max(soup.coordinate_error, 1e-11 * glm::length(glm::max(glm::abs(low), glm::abs(high))));
  return std::ranges::any_of(planes, [&](const PolygonPlane& plane) {
    const double least = kOfSize * size + kOfTilt * error * size / width(plane);
    return std::ranges::any_of(corners, [&](const Vec3& corner) {
      return glm::dot(plane.normal, corner - plane.middle) > least;
    });
  });
}

/// A group, and what decides whether another lies in it.
struct Solid {
  SolidGroup group;
  TriangleSurface triangles;
  double volume = 0;     // m^3; 0 where it is not a solid
  bool is_void = false;  // all faces are turned
  std::vector<std::size_t> voids = {};
  Vec3 low{std::numeric_limits<double>::max()}, high{-low};
};

Solid solid_of(SolidGroup group) {
  Solid solid{std::move(group), {}};
  solid.triangles = triangles_of(solid.group.soup);
  for (const Vec3& vertex : solid.group.soup.vertices) {
    solid.low = glm::min(solid.low, vertex);
    solid.high = glm::max(solid.high, vertex);
  }
  if (!is_closed(solid.group.soup)) return solid;
  const SolidBulk bulk = bulk_of(solid.triangles);
  const double error =
      std::max(solid.group.soup.coordinate_error, 1e-11 * glm::length(solid.high - solid.low));
  solid.is_void = bulk.volume < -2 * error * bulk.area;
  solid.volume = std::abs(bulk.volume);
  return solid;
}

// Tests some corners only.
bool lies_in(const Solid& inner, const Solid& outer) {
  if (glm::any(glm::lessThan(inner.low, outer.low)) ||
      glm::any(glm::greaterThan(inner.high, outer.high)))
    return false;
  constexpr std::size_t kCorners = 16;
  const std::vector<Vec3>& corners = inner.group.soup.vertices;
  for (std::size_t i = 0; i < corners.size(); i += 1 + corners.size() / kCorners) {
    if (winding_number(outer.triangles, corners[i]) < 0.9) return false;
  }
  return true;
}

void append(PolygonSoup& soup, const PolygonSoup& other) {
  const auto first = static_cast<Index>(soup.vertices.size());
  MeshNames names = *soup.names;
  names.vertices.insert(names.vertices.end(), other.names->vertices.begin(),
                        other.names->vertices.end());
  names.faces.insert(names.faces.end(), other.names->faces.begin(), other.names->faces.end());
  soup.names = std::make_shared<const MeshNames>(std::move(names));
  soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (std::vector<Index> face : other.faces) {
    for (Index& v : face) v += first;
    soup.faces.push_back(std::move(face));
  }
}

std::vector<SolidGroup> with_voids(std::vector<Solid> solids) {
  std::vector<std::string> faults;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (!solids[i].is_void) continue;
    std::size_t least = solids.size();
    for (std::size_t k = 0; k < solids.size(); ++k) {
      if (solids[k].is_void || solids[k].volume <= solids[i].volume) continue;
      if (least < solids.size() && solids[k].volume >= solids[least].volume) continue;
      if (lies_in(solids[i], solids[k])) least = k;
    }
    if (least == solids.size()) {
      faults.push_back(
          solids[i].group.name +
          ": inside out: all faces are clockwise seen from outside, as of a void; expected "
          "counter-clockwise, or another closed group round it");
    } else {
      solids[least].voids.push_back(i);
    }
  }
  if (!faults.empty()) throw MeshError(std::move(faults));
  std::vector<SolidGroup> groups;
  for (Solid& solid : solids) {
    if (solid.is_void) continue;
    for (const std::size_t inner : solid.voids) append(solid.group.soup, solids[inner].group.soup);
    groups.push_back(std::move(solid.group));
  }
  return groups;
}

}  // namespace

double volume_of(const ConvexMesh& mesh) {
  double volume = 0;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const Facet& facet = mesh.facets()[f];
    const auto corner = [&](std::uint32_t k) {
      const Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
      return (edge.left == f ? edge.from : edge.to) - mesh.centre();
    };
    const Vec3 first = corner(0);
    for (std::uint32_t k = 2; k < facet.side_count; ++k)
      volume += glm::dot(first, glm::cross(corner(k - 1), corner(k))) / 6;
  }
  return volume;
}

std::vector<SolidGroup> solid_groups(const PolygonSoup& soup) {
  if (soup.group_names.size() < 2) return {};
  std::vector<std::vector<Index>> faces_of(soup.group_names.size());
  for (Index f = 0; f < soup.faces.size(); ++f) faces_of[soup.group_of[f]].push_back(f);
  Subsets subsets(soup);
  std::vector<Solid> closed;
  std::vector<Index> rest;
  for (std::size_t g = 0; g < faces_of.size(); ++g) {
    if (faces_of[g].empty()) continue;
    PolygonSoup group = subsets.of(faces_of[g]);
    if (!is_closed(group)) {
      rest.insert(rest.end(), faces_of[g].begin(), faces_of[g].end());
      continue;
    }
    closed.push_back(solid_of({"group '" + soup.group_names[g] + "'", std::move(group)}));
    if (closed.size() > kMostClosedGroups) {
      MeshFaults faults;
      faults.add("too many groups", [] {
        return "expected at most " + std::to_string(kMostClosedGroups) +
               " that are closed by themselves, found more";
      });
      faults.throw_if_any();
    }
  }
  if (closed.empty()) return {};
  if (!rest.empty()) {
    std::sort(rest.begin(), rest.end());
    closed.push_back(solid_of({"the groups that are not closed by themselves", subsets.of(rest)}));
  }
  return with_voids(std::move(closed));
}

std::vector<ConvexMesh> convex_parts(const PolygonSoup& soup) {
  std::vector<ConvexMesh> parts;
  std::vector<SolidGroup> groups;
  try {
    parts.emplace_back(soup);
    return parts;
  } catch (const MeshError&) {
    groups = solid_groups(soup);
    if (groups.empty()) throw;
  }
  std::vector<std::string> faults;
  for (const SolidGroup& group : groups) {
    try {
      parts.emplace_back(group.soup);
    } catch (const MeshError& error) {
      for (const std::string& fault : error.faults()) faults.push_back(group.name + ": " + fault);
    }
  }
  if (!faults.empty()) throw MeshError(std::move(faults));
  return parts;
}

std::optional<std::vector<ConvexMesh>> convex_as_it_is(const PolygonSoup& soup) {
  if (is_plainly_concave(soup)) return std::nullopt;
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
