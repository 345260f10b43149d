// A set may grow through a face that lies wholly on another convex part: the set and the piece of
// that part behind the set's other planes are convex together.
#include "stimuli/parts/convex_sets.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

constexpr int kMostSteps = 64;  // of one set

/// Null: too thin to matter.
MeshPointer bounded(const std::vector<HalfSpace>& planes, const Vec3& inside, double size) {
  try {
    return body_behind(planes, inside, size);
  } catch (const MeshError&) {
    return nullptr;
  }
}

using Faces = std::vector<CellPolygon>;

struct Box {
  Vec3 low{1e300}, high{-1e300};
};

Box box_of(const Faces& faces) {
  Box box;
  for (const CellPolygon& face : faces) {
    for (const Vec3& corner : face.corners) {
      box.low = glm::min(box.low, corner);
      box.high = glm::max(box.high, corner);
    }
  }
  return box;
}

bool touch(const Box& a, const Box& b, double tolerance) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.low[axis] > b.high[axis] + tolerance || b.low[axis] > a.high[axis] + tolerance)
      return false;
  }
  return true;
}

// Every corner of `others` is behind every plane of `faces` but one.
bool behind(const Faces& others, const Faces& faces, std::uint32_t but, const PlaneTable& planes) {
  for (const CellPolygon& face : faces) {
    if (face.on.plane == but) continue;
    const Plane& plane = planes[face.on.plane];
    const double sign = face.on.flipped ? -1 : 1;
    for (const CellPolygon& other : others) {
      for (const Vec3& corner : other.corners) {
        if (sign * plane.height(corner) > planes.tolerance()) return false;
      }
    }
  }
  return true;
}

// The corners of a facet in order round their middle, counter-clockwise about `normal`.
void order_round(std::vector<std::uint32_t>& corners, const std::vector<Vec3>& points,
                 const Vec3& normal) {
  Vec3 middle;
  for (const std::uint32_t c : corners) middle += points[c] / static_cast<double>(corners.size());
  const Vec3 x = glm::normalize(points[corners[0]] - middle), y = glm::cross(normal, x);
  std::vector<std::pair<double, std::uint32_t>> order;
  for (const std::uint32_t c : corners) {
    const Vec3 arm = points[c] - middle;
    order.emplace_back(c == corners[0] ? 0 : std::atan2(glm::dot(arm, y), glm::dot(arm, x)), c);
  }
  std::sort(order.begin(), order.end());
  for (std::size_t k = 0; k < order.size(); ++k) corners[k] = order[k].second;
}

bool is_closed(const std::vector<std::vector<std::uint32_t>>& polygons) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> open;
  for (const auto& polygon : polygons) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const std::uint32_t from = polygon[k], to = polygon[(k + 1) % polygon.size()];
      if (open.erase({to, from}) == 0 && !open.emplace(from, to).second) return false;
    }
  }
  return open.empty();
}

/// Joins two polyhedra on either side of a plane and removes the plane.
class Union {
 public:
  Union(const Faces& below, const Faces& above, std::uint32_t plane, const PlaneTable& planes)
      : planes_(planes) {
    for (const Faces* half : {&below, &above}) {
      for (const CellPolygon& face : *half) {
        if (face.on.plane == plane) continue;
        auto& facet = facets_[{face.on.plane, face.on.flipped}];
        for (const Vec3& corner : face.corners) {
          facet.push_back(static_cast<std::uint32_t>(points_.size()));
          points_.push_back(corner);
        }
      }
    }
  }

  /// Corners are points where three facets meet; the others lay on the removed plane.
  std::optional<Faces> faces() {
    const std::vector<std::uint32_t> kept = weld(points_, 2 * planes_.tolerance());
    std::vector<int> facets_at(points_.size(), 0);
    for (auto& [side, corners] : facets_) {
      for (std::uint32_t& c : corners) c = kept[c];
      std::sort(corners.begin(), corners.end());
      corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
      for (const std::uint32_t c : corners) ++facets_at[c];
    }
    Faces faces;
    std::vector<std::vector<std::uint32_t>> polygons;
    for (auto& [side, corners] : facets_) {
      std::erase_if(corners, [&](std::uint32_t c) { return facets_at[c] < 3; });
      if (corners.size() < 3) return std::nullopt;
      const auto& [plane, flipped] = side;
      order_round(corners, points_, flipped ? -planes_[plane].normal : planes_[plane].normal);
      polygons.push_back(corners);
      CellPolygon face{{}, {plane, flipped}};
      for (const std::uint32_t c : corners) face.corners.push_back(points_[c]);
      faces.push_back(std::move(face));
    }
    if (!is_closed(polygons)) return std::nullopt;
    return faces;
  }

 private:
  const PlaneTable& planes_;
  std::vector<Vec3> points_;
  std::map<std::pair<std::uint32_t, bool>, std::vector<std::uint32_t>> facets_;
};

class Merger {
 public:
  Merger(std::vector<Faces>& parts, const PlaneTable& planes) : parts_(parts), planes_(planes) {
    for (std::uint32_t p = 0; p < parts.size(); ++p) add(p);
  }

  void run() {
    for (std::uint32_t p = 0; p < parts_.size(); ++p) {
      while (merge_some(p)) {
      }
    }
    std::erase_if(parts_, [](const Faces& faces) { return faces.empty(); });
  }

 private:
  void add(std::uint32_t part) {
    boxes_.resize(parts_.size());
    boxes_[part] = box_of(parts_[part]);
    for (const CellPolygon& face : parts_[part]) at_[{face.on.plane, face.on.flipped}].insert(part);
  }

  void remove(std::uint32_t part) {
    for (const CellPolygon& face : parts_[part]) at_[{face.on.plane, face.on.flipped}].erase(part);
  }

  // Merges a part with one of its neighbours under the lower number.
  bool merge_some(std::uint32_t part) {
    for (const CellPolygon& face : parts_[part]) {
      const auto across = at_.find({face.on.plane, !face.on.flipped});
      if (across == at_.end()) continue;
      for (const std::uint32_t other : across->second) {
        if (!touch(boxes_[part], boxes_[other], planes_.tolerance())) continue;
        if (merge(part, other, face.on.plane)) return true;
      }
    }
    return false;
  }

  bool merge(std::uint32_t part, std::uint32_t other, std::uint32_t plane) {
    if (!behind(parts_[other], parts_[part], plane, planes_) ||
        !behind(parts_[part], parts_[other], plane, planes_))
      return false;
    std::optional<Faces> both = Union(parts_[part], parts_[other], plane, planes_).faces();
    if (!both) return false;
    const CellBulk one = bulk_of(parts_[part]), two = bulk_of(parts_[other]), all = bulk_of(*both);
    if (std::abs(all.volume - one.volume - two.volume) > planes_.tolerance() * all.area)
      return false;
    remove(part);
    remove(other);
    parts_[part] = std::move(*both);
    parts_[other].clear();
    add(part);
    return true;
  }

  std::vector<Faces>& parts_;
  const PlaneTable& planes_;
  std::vector<Box> boxes_;
  std::map<std::pair<std::uint32_t, bool>, std::set<std::uint32_t>> at_;  // by plane and side
};

}  // namespace

double height_over(const ConvexMesh& mesh, const Vec3& p) {
  double most = -HUGE_VAL;
  for (const Facet& facet : mesh.facets())
    most = std::max(most, glm::dot(facet.normal, p) - facet.offset);
  return most;
}

std::vector<Vec3> corners_of(const ConvexMesh& mesh, std::uint32_t f) {
  const Facet& facet = mesh.facets()[f];
  std::vector<Vec3> corners;
  for (std::uint32_t k = 0; k < facet.side_count; ++k) {
    const Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
    corners.push_back(edge.left == f ? edge.from : edge.to);
  }
  return corners;
}

ConvexSet whole(const MeshPointer& part) {
  ConvexSet out{part, {}};
  for (const Facet& facet : part->facets()) out.planes.push_back({facet.normal, facet.offset});
  return out;
}

SetGrowth::SetGrowth(const std::vector<MeshPointer>& parts, double abuts) : abuts_(abuts) {
  double size = 0;
  for (const MeshPointer& part : parts) size = std::max(size, part->size());
  tolerance_ = abuts * size;
}

/// The set grown through a face that lies wholly on another part, as far as that part and the set's
/// other planes go. Where the set touches the face's plane in that face only, both together are
/// convex.
std::optional<ConvexSet> SetGrowth::through(const ConvexSet& set, std::uint32_t f,
                                            const ConvexMesh& beyond) const {
  const Facet& face = set.mesh->facets()[f];
  bool extends = false;
  for (const Vec3& v : beyond.vertices())
    extends |= glm::dot(face.normal, v) - face.offset > 4 * tolerance_;
  if (!extends) return std::nullopt;
  for (const Vec3& corner : corners_of(*set.mesh, f))
    if (height_over(beyond, corner) > tolerance_) return std::nullopt;
  const auto same = [&](const HalfSpace& plane, const Vec3& normal, double offset) {
    const Vec3& at = set.mesh->centre();
    return glm::length(plane.normal - normal) < abuts_ &&
           std::abs(plane.offset - offset + glm::dot(normal - plane.normal, at)) <= 2 * tolerance_;
  };
  ConvexSet larger;
  for (const HalfSpace& plane : set.planes)
    if (!same(plane, face.normal, face.offset)) larger.planes.push_back(plane);
  for (const Facet& facet : beyond.facets()) {
    const auto& v = set.mesh->vertices();
    const bool behind = std::all_of(v.begin(), v.end(), [&](const Vec3& p) {
      return glm::dot(facet.normal, p) - facet.offset <= tolerance_;
    });
    const bool known = std::any_of(
        larger.planes.begin(), larger.planes.end(),
        [&](const HalfSpace& plane) { return same(plane, facet.normal, facet.offset); });
    if (behind && !known) larger.planes.push_back({facet.normal, facet.offset});
  }
  larger.mesh = bounded(larger.planes, largest_inscribed_ball(*set.mesh).centre,
                        set.mesh->size() + beyond.size());
  if (!larger.mesh) return std::nullopt;
  return larger;
}

/// Gives up the piece of the set beside the other part where the point does not need it.
std::optional<ConvexSet> SetGrowth::narrowed_through(const ConvexSet& set, std::uint32_t f,
                                                     const ConvexMesh& beyond,
                                                     const Kept& kept) const {
  const Facet& face = set.mesh->facets()[f];
  const double height = glm::dot(face.normal, *kept.point) - face.offset;
  if (height < -kept.depth) return std::nullopt;  // it needs nothing from beyond
  ConvexSet narrow = set;
  for (const Facet& facet : beyond.facets()) {
    bool crosses = false;
    for (const Vec3& corner : corners_of(*set.mesh, f))
      crosses |= glm::dot(facet.normal, corner) - facet.offset > tolerance_;
    if (!crosses) continue;
    if (glm::dot(facet.normal, *kept.point) - facet.offset > -kept.depth) return std::nullopt;
    const std::optional<ConvexSet> cut = behind(narrow, {facet.normal, facet.offset});
    if (!cut) return std::nullopt;
    narrow = *cut;
  }
  for (std::uint32_t g = 0; g < narrow.mesh->facets().size(); ++g) {
    const Facet& same = narrow.mesh->facets()[g];
    if (glm::length(same.normal - face.normal) < abuts_) return through(narrow, g, beyond);
  }
  return std::nullopt;
}

std::optional<ConvexSet> SetGrowth::step(const ConvexSet& set,
                                         const std::vector<MeshPointer>& others, const Kept& kept,
                                         bool narrower) const {
  std::vector<const ConvexMesh*> near;
  for (const MeshPointer& other : others) {
    if (glm::distance(other->centre(), set.mesh->centre()) <=
        other->radius() + set.mesh->radius() + tolerance_)
      near.push_back(other.get());
  }
  for (std::uint32_t f = 0; f < set.mesh->facets().size(); ++f) {
    const Vec3& normal = set.mesh->facets()[f].normal;
    if (kept.plane && glm::length(kept.plane->normal - normal) < abuts_) continue;
    for (const ConvexMesh* const other : near) {
      std::optional<ConvexSet> larger =
          narrower ? narrowed_through(set, f, *other, kept) : through(set, f, *other);
      if (larger) return larger;
    }
  }
  return std::nullopt;
}

ConvexSet SetGrowth::grown(ConvexSet set, const std::vector<MeshPointer>& others,
                           const Kept& kept) const {
  for (int i = 0; i < kMostSteps; ++i) {
    std::optional<ConvexSet> larger = step(set, others, kept, false);
    if (!larger && kept.point) larger = step(set, others, kept, true);
    if (!larger) break;
    set = std::move(*larger);
  }
  return set;
}

std::optional<ConvexSet> SetGrowth::behind(const ConvexSet& set, const HalfSpace& plane) const {
  const auto height = [&](const Vec3& p) { return glm::dot(plane.normal, p) - plane.offset; };
  std::vector<Vec3> left;
  double lowest = 0, highest = 0;
  for (const Vec3& v : set.mesh->vertices()) {
    lowest = std::min(lowest, height(v));
    highest = std::max(highest, height(v));
    if (height(v) <= 0) left.push_back(v);
  }
  if (highest <= 4 * tolerance_) return set;
  if (lowest >= -100 * tolerance_) return std::nullopt;  // nothing but rounding
  for (const Edge& edge : set.mesh->edges()) {
    const double a = height(edge.from), b = height(edge.to);
    if ((a < 0) != (b < 0)) left.push_back(edge.from + a / (a - b) * (edge.to - edge.from));
  }
  Vec3 middle(0);
  for (const Vec3& p : left) middle += p / static_cast<double>(left.size());
  ConvexSet out = set;
  out.planes.push_back(plane);
  out.mesh = bounded(out.planes, middle, set.mesh->size());
  if (!out.mesh) return std::nullopt;
  return out;
}

void merge_convex_neighbours(std::vector<std::vector<CellPolygon>>& parts,
                             const PlaneTable& planes) {
  Merger(parts, planes).run();
}

}  // namespace palpate::stimuli
