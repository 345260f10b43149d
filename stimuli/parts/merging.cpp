#include "stimuli/parts/merging.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "stimuli/weld.h"

namespace palpate::stimuli {
namespace {

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

/// Two polyhedra on either side of a plane as one, without it.
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

  /// Corners are where three facets meet: others were on the plane that is gone.
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

  // A part with one of its neighbours, of which the lower number becomes both.
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

void merge_convex_neighbours(std::vector<std::vector<CellPolygon>>& parts,
                             const PlaneTable& planes) {
  Merger(parts, planes).run();
}

}  // namespace palpate::stimuli
