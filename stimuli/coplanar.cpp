#include "stimuli/coplanar.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "stimuli/face_triangles.h"
#include "stimuli/mesh_names.h"
#include "stimuli/plane_deviation.h"

namespace palpate::stimuli {
namespace {

using Index = HalfEdges::Index;

using Index = std::uint32_t;

PolygonExtent extent_of(const HalfEdges& mesh, Index h) {
  const Index face = mesh.face[h], corners = mesh.first[face + 1] - mesh.first[face];
  // A sample of the corners of a large polygon is enough: all would cost their number squared.
  const Index stride = std::max<Index>(1, corners / 16);
  PolygonExtent extent(mesh.to(h) - mesh.from(h));
  for (Index k = 0; k < corners; k += stride) {
    const Index corner = mesh.first[face] + (h - mesh.first[face] + 2 + k) % corners;
    extent.include(mesh.from(corner) - mesh.from(h));
  }
  return extent;
}

// A planar region under construction.
class Region {
 public:
  Region(const HalfEdges& mesh, const FaceShape& seed, Index face)
      : mesh_(mesh), low_(seed.middle), high_(seed.middle) {
    add(seed, face);
  }

  void add(const FaceShape& shape, Index face) {
    area_ += shape.area;
    normal_ += shape.area * shape.normal;
    moment_ += shape.area * (shape.middle - mesh_.points[0]);
    for (Index h = mesh_.first[face]; h < mesh_.first[face + 1]; ++h) {
      low_ = glm::min(low_, mesh_.from(h));
      high_ = glm::max(high_, mesh_.from(h));
    }
  }

  // Whether the face across half-edge h lies in the plane. The plane is known to the error over the
  // region's width, and the face extends past it: the tolerance allows for that.
  bool contains_face_across(Index h) const {
    const Vec3 normal = glm::normalize(normal_);
    const Vec3 middle = mesh_.points[0] + moment_ / area_;
    const double width = area_ / glm::distance(low_, high_);
    const Index beyond = mesh_.twin[h], face = mesh_.face[beyond];
    const double across = extent_of(mesh_, beyond).across();
    const double allowed = 2 * kCoplanar * mesh_.error * (1 + across / width);
    for (Index k = mesh_.first[face]; k < mesh_.first[face + 1]; ++k) {
      if (std::abs(glm::dot(normal, mesh_.from(k) - middle)) > allowed) return false;
    }
    return true;
  }

 private:
  const HalfEdges& mesh_;
  Vec3 normal_, moment_, low_, high_;
  double area_ = 0;
};

void grow(const HalfEdges& mesh, const std::vector<FaceShape>& shapes, Index seed, Index number,
          std::vector<Index>& region_of) {
  Region region(mesh, shapes[seed], seed);
  region_of[seed] = number;
  std::deque<Index> border{seed};
  while (!border.empty()) {
    const Index face = border.front();
    border.pop_front();
    for (Index h = mesh.first[face]; h < mesh.first[face + 1]; ++h) {
      const Index beyond = mesh.face[mesh.twin[h]];
      if (region_of[beyond] != HalfEdges::kNone || shapes[beyond].thin) continue;
      if (std::abs(plane_deviation_at(mesh, shapes, h)) > kCoplanar ||
          !region.contains_face_across(h))
        continue;
      region.add(shapes[beyond], beyond);
      region_of[beyond] = number;
      border.push_back(beyond);
    }
  }
}

Index longest_side(const HalfEdges& mesh, Index face) {
  Index longest = mesh.first[face];
  for (Index h = longest; h < mesh.first[face + 1]; ++h) {
    if (glm::distance(mesh.from(h), mesh.to(h)) >
        glm::distance(mesh.from(longest), mesh.to(longest))) {
      longest = h;
    }
  }
  return longest;
}

// A degenerate face joins the region across its longest side; where that face is degenerate as
// well, any region that it touches.
void assign_thin_faces(const HalfEdges& mesh, std::vector<Index> thin,
                       std::vector<Index>& region_of) {
  bool only_longest = true;
  while (!thin.empty()) {
    const std::size_t before = thin.size();
    std::erase_if(thin, [&](Index face) {
      const Index longest = longest_side(mesh, face);
      for (Index h = mesh.first[face]; h < mesh.first[face + 1]; ++h) {
        if (only_longest && h != longest) continue;
        const Index beyond = region_of[mesh.face[mesh.twin[h]]];
        if (beyond == HalfEdges::kNone) continue;
        region_of[face] = beyond;
        return true;
      }
      return false;
    });
    if (thin.size() < before) {
      only_longest = true;
    } else if (only_longest) {
      only_longest = false;
    } else {
      return;
    }
  }
}

// Numbered in the order of faces, so that later passes run through memory in order.
void renumber(std::vector<Index>& region_of, Index& count) {
  std::vector<Index> number(count, HalfEdges::kNone);
  Index next = 0;
  for (Index& region : region_of) {
    if (number[region] == HalfEdges::kNone) number[region] = next++;
    region = number[region];
  }
}

class Outliner {
 public:
  Outliner(const HalfEdges& mesh, const std::vector<Index>& region_of, Index region_count)
      : mesh_(mesh),
        region_of_(region_of),
        borders_at_(mesh.points.size(), 0),
        border_length_(region_count, 0),
        begin_(region_count, HalfEdges::kNone),
        side_at_(mesh.count(), HalfEdges::kNone) {
    for (Index h = 0; h < mesh.count(); ++h) {
      if (!is_border(h)) continue;
      ++borders_at_[mesh.origin[h]];
      ++border_length_[region_of[mesh.face[h]]];
    }
    for (Index h = mesh.count(); h-- > 0;) {
      if (is_border(h) && is_corner(mesh.origin[h])) begin_[region_of[mesh.face[h]]] = h;
    }
  }

  FacetOutlines outlines(MeshFaults& faults) {
    for (Index region = 0; region < begin_.size(); ++region) trace(region, faults);
    outlines_.first.push_back(outlines_.side_count());
    if (!faults.empty()) return std::move(outlines_);
    for (const Index last : last_) outlines_.opposite.push_back(side_at_[mesh_.twin[last]]);
    return std::move(outlines_);
  }

 private:
  bool is_border(Index h) const {
    return region_of_[mesh_.face[h]] != region_of_[mesh_.face[mesh_.twin[h]]];
  }

  // Between two regions only, a vertex lies within a straight edge.
  bool is_corner(Index vertex) const { return borders_at_[vertex] >= 3; }

  Index next_border(Index h) const {
    h = mesh_.next(h);
    while (!is_border(h)) h = mesh_.next(mesh_.twin[h]);
    return h;
  }

  void trace(Index region, MeshFaults& faults) {
    outlines_.first.push_back(outlines_.side_count());
    const Index begin = begin_[region];
    Index walked = 0;
    if (begin != HalfEdges::kNone) {
      Index h = begin;
      do {
        if (is_corner(mesh_.origin[h])) {
          side_at_[h] = outlines_.side_count();
          outlines_.start.push_back(h);
          outlines_.region.push_back(region);
          last_.push_back(h);
        } else {
          last_.back() = h;
        }
        ++walked;
        h = next_border(h);
      } while (h != begin);
    }
    if (outlines_.side_count() - outlines_.first.back() < 3) {
      faults.add("no polygon", [&] {
        return name(region) +
               ": expected a facet with at least three corners (is the object flat?)";
      });
    } else if (walked != border_length_[region]) {
      faults.add("hole", [&] {
        return name(region) + ": expected a facet with one outline, found one with holes";
      });
    }
  }

  std::string name(Index region) const {
    for (Index f = 0; f < mesh_.face_count(); ++f) {
      if (region_of_[f] == region) return mesh_.name_face(f);
    }
    return "facet";
  }

  const HalfEdges& mesh_;
  const std::vector<Index>& region_of_;
  std::vector<Index> borders_at_;     // of each vertex
  std::vector<Index> border_length_;  // of each region, in half-edges
  std::vector<Index> begin_;          // of each region, a border half-edge at a corner
  std::vector<Index> side_at_;        // of each half-edge that begins a side
  std::vector<Index> last_;           // of each side, its last half-edge
  FacetOutlines outlines_;
};

/// A side of one of several triangles at an edge.
struct Turned {
  double angle;  // about the edge
  bool opens;    // solid begins here as the angle grows
  SideGroups::Side side;
};

// Sorted by angle. Solid that begins is paired with the solid that ends, first with first: each
// pair bounds a wedge of solid, and the wedges are all of the solid at the edge.
void link_fan(const std::vector<Vec3>& vertices, const std::vector<std::array<Index, 3>>& triangles,
              const SideGroups::Edge& edge, std::vector<std::array<Index, 3>>& across) {
  const Vec3 from = vertices[edge.low], along = glm::normalize(vertices[edge.high] - from);
  Vec3 x(0);
  std::vector<Turned> fan;
  for (const SideGroups::Side& side : edge.sides) {
    Vec3 away = vertices[triangles[side.triangle()][(side.k() + 2) % 3]] - from;
    away -= glm::dot(away, along) * along;
    if (x == Vec3(0)) x = away;
    const double angle = std::atan2(glm::dot(glm::cross(along, x), away), glm::dot(x, away));
    fan.push_back({angle, !side.up(), side});
  }
  std::sort(fan.begin(), fan.end(), [](const Turned& a, const Turned& b) {
    if (a.angle != b.angle) return a.angle < b.angle;
    return a.opens != b.opens ? a.opens : a.side.code < b.side.code;
  });
  // Begin where fewest are open.
  int open = 0, fewest = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    open += fan[i].opens ? 1 : -1;
    if (open < fewest) {
      fewest = open;
      begin = i + 1;
    }
  }
  std::rotate(fan.begin(), fan.begin() + static_cast<std::ptrdiff_t>(begin % fan.size()),
              fan.end());
  std::vector<SideGroups::Side> opened;
  std::size_t next = 0;
  for (const Turned& turned : fan) {
    if (turned.opens) {
      opened.push_back(turned.side);
      continue;
    }
    const SideGroups::Side a = opened[next++], b = turned.side;
    across[a.triangle()][a.k()] = b.triangle();
    across[b.triangle()][b.k()] = a.triangle();
  }
}

}  // namespace

std::vector<FaceShape> shapes_of(const HalfEdges& mesh) {
  std::vector<FaceShape> shapes(mesh.face_count());
  std::vector<Vec3> corners;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    corners.clear();
    for (Index h = mesh.first[f]; h < mesh.first[f + 1]; ++h) corners.push_back(mesh.from(h));
    const PolygonPlane plane = plane_of(corners);
    const double height = 2 * plane.area / plane.diameter;
    shapes[f] = {plane.area, plane.normal, plane.middle, !(height > 4 * mesh.error)};
  }
  return shapes;
}

void check_flatness(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                    MeshFaults& faults) {
  for (Index f = 0; f < mesh.face_count(); ++f) {
    if (mesh.first[f + 1] - mesh.first[f] == 3 || shapes[f].thin) continue;
    double off = 0;
    for (Index h = mesh.first[f]; h < mesh.first[f + 1]; ++h) {
      off = std::max(off, std::abs(glm::dot(shapes[f].normal, mesh.from(h) - shapes[f].middle)));
    }
    if (off <= 2 * kCoplanar * mesh.error) continue;
    faults.add("bent face", [&] {
      return mesh.name_face(f) + ": expected corners in one plane, found them up to " +
             std::to_string(off / mesh.size) + " of the object's size off it";
    });
  }
}

double plane_deviation_at(const HalfEdges& mesh, const std::vector<FaceShape>& shapes, Index h) {
  const Index twin = mesh.twin[h];
  return plane_deviation(shapes[mesh.face[h]].normal, shapes[mesh.face[twin]].normal,
                         mesh.to(h) - mesh.from(h), extent_of(mesh, h), extent_of(mesh, twin),
                         mesh.error);
}

std::vector<Index> coplanar_regions(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                                    Index& count) {
  // The largest faces first: their planes are known best.
  std::vector<std::pair<double, Index>> seeds;
  std::vector<Index> thin;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    if (shapes[f].thin) {
      thin.push_back(f);
    } else {
      seeds.emplace_back(-shapes[f].area, f);
    }
  }
  std::sort(seeds.begin(), seeds.end());
  std::vector<Index> region_of(mesh.face_count(), HalfEdges::kNone);
  count = 0;
  for (const auto& [area, face] : seeds) {
    if (region_of[face] == HalfEdges::kNone) grow(mesh, shapes, face, count++, region_of);
  }
  if (count == 0) return region_of;
  assign_thin_faces(mesh, std::move(thin), region_of);
  renumber(region_of, count);
  return region_of;
}

std::vector<Index> single_regions(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                                  Index& count) {
  std::vector<Index> region_of(mesh.face_count(), HalfEdges::kNone), thin;
  count = 0;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    if (shapes[f].thin) {
      thin.push_back(f);
    } else {
      region_of[f] = count++;
    }
  }
  if (count == 0) return region_of;
  assign_thin_faces(mesh, std::move(thin), region_of);
  renumber(region_of, count);
  return region_of;
}

FacetOutlines facet_outlines(const HalfEdges& mesh, const std::vector<Index>& region_of,
                             Index region_count, MeshFaults& faults) {
  return Outliner(mesh, region_of, region_count).outlines(faults);
}

SideGroups::SideGroups(std::size_t vertex_count, const std::vector<std::array<Index, 3>>& triangles)
    : first_(vertex_count + 1, 0), sides_(3 * triangles.size()) {
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++first_[std::min(t[k], t[(k + 1) % 3])];
  }
  Index sum = 0;
  for (Index& first : first_) {
    sum += first;
    first = sum;
  }
  for (auto i = static_cast<Index>(triangles.size()); i-- > 0;) {
    const auto& t = triangles[i];
    for (Index k = 3; k-- > 0;) {
      const Index a = t[k], b = t[(k + 1) % 3];
      sides_[--first_[std::min(a, b)]] = {std::max(a, b), 6 * i + 2 * k + (a < b ? 1U : 0U)};
    }
  }
  for (std::size_t v = 0; v < vertex_count; ++v) {
    std::sort(sides_.begin() + first_[v], sides_.begin() + first_[v + 1],
              [](const Side& a, const Side& b) {
                return a.other != b.other ? a.other < b.other : a.code < b.code;
              });
  }
}

void link_triangles(const std::vector<Vec3>& vertices,
                    const std::vector<std::array<Index, 3>>& triangles,
                    std::vector<std::array<Index, 3>>& across) {
  across.assign(triangles.size(), {});
  SideGroups(vertices.size(), triangles).for_each_edge([&](const SideGroups::Edge& edge) {
    if (edge.sides.size() > 2) {
      link_fan(vertices, triangles, edge, across);
      return;
    }
    const SideGroups::Side a = edge.sides[0], b = edge.sides[1];
    across[a.triangle()][a.k()] = b.triangle();
    across[b.triangle()][b.k()] = a.triangle();
  });
}

}  // namespace palpate::stimuli
