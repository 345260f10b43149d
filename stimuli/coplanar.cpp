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

}  // namespace palpate::stimuli
