#include "stimuli/half_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/weld.h"

namespace palpate::stimuli {
namespace {

using Index = HalfEdges::Index;

bool is_usable(const Vec3& v) {
  // NaN fails the comparison. Larger numbers would overflow in products, and no object is that far
  // away.
  constexpr double kLargest = 1e30;
  return std::abs(v.x) <= kLargest && std::abs(v.y) <= kLargest && std::abs(v.z) <= kLargest;
}

// Corners that no face uses are left out: they must not make the object seem larger than it is.
// \return how many points were welded to one that is near but not at the same place.
std::size_t take_points(const PolygonSoup& soup, HalfEdges& mesh, std::vector<Index>& point_of) {
  std::vector<char> used(soup.vertices.size(), 0);
  for (const auto& face : soup.faces) {
    for (const Index v : face) used[v] = 1;
  }
  std::vector<Vec3> points;
  std::vector<Index> soup_vertex;
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (Index v = 0; v < soup.vertices.size(); ++v) {
    if (used[v] == 0) continue;
    points.push_back(soup.vertices[v]);
    soup_vertex.push_back(v);
    low = glm::min(low, soup.vertices[v]);
    high = glm::max(high, soup.vertices[v]);
  }
  mesh.size = glm::length(high - low);
  const Vec3 far = glm::max(glm::abs(low), glm::abs(high));
  // How far corners may be off. 1e-11 of the size allows for the arithmetic of the program that
  // made the object, and is still 1e-5 of the width of a needle a million times longer than wide;
  // far from the origin the spacing of the coordinates themselves is coarser.
  mesh.error =
      std::max({soup.coordinate_error, 1e-11 * mesh.size,
                8 * std::numeric_limits<double>::epsilon() * std::max({far.x, far.y, far.z})});
  const std::vector<Index> kept = weld(points, 4 * mesh.error);
  point_of.assign(soup.vertices.size(), HalfEdges::kNone);
  std::size_t moved = 0;
  for (Index i = 0; i < kept.size(); ++i) {
    if (kept[i] == i) {
      point_of[soup_vertex[i]] = static_cast<Index>(mesh.points.size());
      mesh.points.push_back(points[i]);
      mesh.soup_vertex.push_back(soup_vertex[i]);
    } else {
      point_of[soup_vertex[i]] = point_of[soup_vertex[kept[i]]];
      if (points[i] != points[kept[i]]) ++moved;
    }
  }
  return moved;
}

void take_faces(const PolygonSoup& soup, const std::vector<Index>& point_of, HalfEdges& mesh,
                MeshFaults& faults) {
  std::vector<Index> corners, kept, sorted;
  for (Index f = 0; f < soup.faces.size(); ++f) {
    corners.clear();
    kept.clear();
    for (const Index v : soup.faces[f]) {
      if (!corners.empty() && corners.back() == point_of[v]) continue;
      corners.push_back(point_of[v]);
      kept.push_back(v);
    }
    while (corners.size() > 1 && corners.back() == corners.front()) corners.pop_back();
    if (corners.size() < 3) continue;
    sorted = corners;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      faults.add("crossed face", [&] {
        return name_of_face(soup, f) + ": expected every corner once, found one visited twice";
      });
      continue;
    }
    mesh.first.push_back(mesh.count());
    mesh.soup_face.push_back(f);
    mesh.origin.insert(mesh.origin.end(), corners.begin(), corners.end());
    mesh.corner.insert(mesh.corner.end(), kept.begin(),
                       kept.begin() + static_cast<std::ptrdiff_t>(corners.size()));
    mesh.face.resize(mesh.origin.size(), mesh.face_count() - 1);
  }
  mesh.first.push_back(mesh.count());
}

Index root_of(std::vector<Index>& parent, Index i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void report_pieces(const HalfEdges& mesh, std::vector<Index>& parent, MeshFaults& faults) {
  for (Index f = 1; f < mesh.face_count(); ++f) {
    if (root_of(parent, f) != f) continue;
    faults.add("separate pieces", [&] {
      return mesh.name_face(f) + " is not connected with " + mesh.name_face(0) +
             "; expected one piece";
    });
  }
}

void link_twins(HalfEdges& mesh, MeshFaults& faults, Pieces pieces) {
  mesh.twin.assign(mesh.count(), HalfEdges::kNone);
  std::vector<Index> parent(mesh.face_count());
  std::iota(parent.begin(), parent.end(), Index{0});
  std::vector<char> matched(mesh.count(), 0);
  PairMap first_of(mesh.count() / 2);
  for (Index h = 0; h < mesh.count(); ++h) {
    Index& other = first_of(mesh.origin[h], mesh.origin[mesh.next(h)]);
    if (other == HalfEdges::kNone) {
      other = h;
      continue;
    }
    const Index a = root_of(parent, mesh.face[h]), b = root_of(parent, mesh.face[other]);
    parent[std::max(a, b)] = std::min(a, b);
    if (matched[other] != 0) {
      faults.add("shared edge", [&] {
        return mesh.name_edge(h) + " belongs to three or more faces; expected exactly two";
      });
    } else if (mesh.origin[h] == mesh.origin[other]) {
      faults.add("turned face", [&] {
        return mesh.name_edge(h) + " runs the same way in " + mesh.name_face(mesh.face[other]) +
               "; expected opposite ways (all faces counter-clockwise seen from outside)";
      });
    } else {
      mesh.twin[h] = other;
      mesh.twin[other] = h;
    }
    matched[h] = matched[other] = 1;
  }
  for (Index h = 0; h < mesh.count(); ++h) {
    if (matched[h] != 0) continue;
    faults.add("open", [&] {
      return mesh.name_edge(h) + " has no face on its other side; expected a closed surface";
    });
  }
  if (pieces == Pieces::one) report_pieces(mesh, parent, faults);
}

// Two bodies that touch in one corner share the vertex but not the fan of faces round it.
void check_fans(const HalfEdges& mesh, MeshFaults& faults) {
  std::vector<Index> degree(mesh.points.size(), 0), some(mesh.points.size(), HalfEdges::kNone);
  for (Index h = 0; h < mesh.count(); ++h) {
    ++degree[mesh.origin[h]];
    some[mesh.origin[h]] = h;
  }
  for (Index v = 0; v < mesh.points.size(); ++v) {
    if (some[v] == HalfEdges::kNone) continue;
    Index turned = 0, h = some[v];
    do {
      h = mesh.twin[mesh.previous(h)];
      ++turned;
    } while (h != some[v]);
    if (turned == degree[v]) continue;
    faults.add("shared vertex", [&] {
      return mesh.name_vertex(v) + ": expected one ring of faces round it, found several";
    });
  }
}

}  // namespace

std::string name_of_face(const PolygonSoup& soup, std::size_t f) {
  const MeshNaming naming(soup.names);
  std::vector<std::string> labels;
  for (const Index v : soup.faces[f])
    labels.push_back(naming.label(v, v < soup.vertices.size() ? soup.vertices[v] : Vec3(0)));
  return naming.face(static_cast<Index>(f), labels);
}

void check_numbers(const PolygonSoup& soup) {
  MeshFaults faults;
  if (soup.faces.empty()) faults.add("empty", [] { return "expected faces, found none"; });
  for (Index v = 0; v < soup.vertices.size(); ++v) {
    if (is_usable(soup.vertices[v])) continue;
    faults.add("not finite", [&] {
      return MeshNaming(soup.names).vertex(v, soup.vertices[v]) +
             ": expected three finite coordinates (up to 1e30 m)";
    });
  }
  std::size_t corners = 0;
  for (std::size_t f = 0; f < soup.faces.size(); ++f) {
    const std::vector<Index>& face = soup.faces[f];
    corners += face.size();
    const auto name = [&] { return name_of_face(soup, f); };
    if (face.size() < 3) {
      faults.add("too few corners", [&] { return name() + ": expected at least 3"; });
    }
    for (const Index v : face) {
      if (v < soup.vertices.size()) continue;
      faults.add("no such vertex", [&] {
        return name() + ": expected vertex numbers below " + std::to_string(soup.vertices.size()) +
               ", found " + std::to_string(v);
      });
      break;
    }
  }
  if (corners >= HalfEdges::kNone / 2 || soup.vertices.size() >= HalfEdges::kNone / 2) {
    faults.add("too large", [] { return "expected fewer than 2^31 corners"; });
  }
  faults.throw_if_any();
}

std::string HalfEdges::name_face(Index f) const {
  std::vector<std::string> labels;
  for (Index h = first[f]; h < first[f + 1]; ++h)
    labels.push_back(naming.label(corner[h], from(h)));
  return naming.face(soup_face[f], labels);
}

std::string HalfEdges::name_vertex(Index v) const {
  return naming.vertex(soup_vertex[v], points[v]);
}

std::string HalfEdges::name_edge(Index h) const {
  return "edge " + naming.label(corner[h], from(h)) + "-" + naming.label(corner[next(h)], to(h)) +
         " of " + name_face(face[h]);
}

HalfEdges link_half_edges(const PolygonSoup& soup, MeshFaults& faults, Pieces pieces) {
  check_numbers(soup);
  HalfEdges mesh;
  mesh.naming = MeshNaming(soup.names);
  std::vector<Index> point_of;
  const std::size_t moved = take_points(soup, mesh, point_of);
  take_faces(soup, point_of, mesh, faults);
  link_twins(mesh, faults, pieces);
  if (moved > 0 && !faults.empty()) {
    faults.add("crowded", [&] {
      char error[32];
      std::snprintf(error, sizeof error, "%.1g", mesh.error);
      return std::to_string(moved) +
             " vertices are indistinguishable from others near them, with " +
             "coordinates known to " + error +
             " m; the faults above may result from that: expected more digits or fewer vertices";
    });
  }
  if (faults.empty()) check_fans(mesh, faults);
  return mesh;
}

}  // namespace palpate::stimuli
