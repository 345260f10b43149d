#include "stimuli/parts/cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

namespace palpate::stimuli {
namespace {

struct Extent {
  double low = 0, high = 0;  // m, heights over a plane
};

Extent extent_of(const std::vector<CellPolygon>& polygons, const Plane& plane) {
  Extent extent;
  for (const CellPolygon& polygon : polygons) {
    for (const Vec3& corner : polygon.corners) {
      const double height = plane.height(corner);
      extent.low = std::min(extent.low, height);
      extent.high = std::max(extent.high, height);
    }
  }
  return extent;
}

// From below to above, so that both faces of an edge get the same point to the bit.
Vec3 crossing(const Vec3& below, double low, const Vec3& above, double high) {
  return below + (above - below) * (-low / (high - low));
}

class Cutter {
 public:
  Cutter(std::uint32_t number, const PlaneTable& planes)
      : number_(number), plane_(planes[number]), tolerance_(planes.tolerance()) {}

  void divide(std::vector<CellPolygon>& polygons, std::vector<CellPolygon>& below,
              std::vector<CellPolygon>& above, bool with_rim) {
    for (CellPolygon& polygon : polygons) divide_one(polygon, below, above, with_rim);
  }

  /// The polygon in the plane that closes either half: the rim's points in order round their
  /// middle.
  std::vector<Vec3> cap() {
    Vec3 middle;
    for (const Vec3& point : rim_) middle += point / static_cast<double>(rim_.size());
    const Vec3& n = plane_.normal;
    const Vec3 x =
        glm::normalize(glm::cross(n, std::abs(n.x) < 0.7 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)));
    const Vec3 y = glm::cross(n, x);
    std::vector<std::pair<double, Vec3>> order;
    for (const Vec3& point : rim_) {
      const Vec3 arm = point - middle;
      order.emplace_back(std::atan2(glm::dot(arm, y), glm::dot(arm, x)), point);
    }
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      if (a.first != b.first) return a.first < b.first;
      return std::array{a.second.x, a.second.y, a.second.z} <
             std::array{b.second.x, b.second.y, b.second.z};
    });
    std::vector<Vec3> corners;
    for (const auto& [angle, point] : order) {
      if (corners.empty() || corners.back() != point) corners.push_back(point);
    }
    return corners;
  }

 private:
  void divide_one(CellPolygon& polygon, std::vector<CellPolygon>& below,
                  std::vector<CellPolygon>& above, bool with_rim) {
    const std::size_t count = polygon.corners.size();
    heights_.clear();
    bool under = false, over = false;
    for (const Vec3& corner : polygon.corners) {
      const double height = plane_.height(corner);
      under |= height < -tolerance_;
      over |= height > tolerance_;
      heights_.push_back(height);
      if (with_rim && std::abs(height) <= tolerance_) rim_.push_back(corner);
    }
    if (polygon.on.plane == number_ || (!under && !over)) return;  // in the plane
    if (!over) {
      below.push_back(std::move(polygon));
      return;
    }
    if (!under) {
      above.push_back(std::move(polygon));
      return;
    }
    CellPolygon lower{{}, polygon.on}, upper{{}, polygon.on};
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t next = k + 1 == count ? 0 : k + 1;
      const Vec3 &here = polygon.corners[k], &there = polygon.corners[next];
      const double from = heights_[k], to = heights_[next];
      if (from <= tolerance_) lower.corners.push_back(here);
      if (from >= -tolerance_) upper.corners.push_back(here);
      const bool rises = from < -tolerance_ && to > tolerance_;
      const bool falls = from > tolerance_ && to < -tolerance_;
      if (!rises && !falls) continue;
      const Vec3 point = rises ? crossing(here, from, there, to) : crossing(there, to, here, from);
      lower.corners.push_back(point);
      upper.corners.push_back(point);
      if (with_rim) rim_.push_back(point);
    }
    below.push_back(std::move(lower));
    above.push_back(std::move(upper));
  }

  const std::uint32_t number_;
  const Plane& plane_;
  const double tolerance_;
  std::vector<Vec3> rim_;
  std::vector<double> heights_;
};

}  // namespace

CellBulk bulk_of(const std::vector<CellPolygon>& faces) {
  CellBulk bulk;
  if (faces.empty()) return bulk;
  const Vec3 origin = faces[0].corners[0];
  double corners = 0;
  for (const CellPolygon& face : faces) {
    Vec3 twice_area;
    for (std::size_t k = 0; k < face.corners.size(); ++k) {
      bulk.middle += face.corners[k] - origin;
      ++corners;
      if (k < 2) continue;
      twice_area +=
          glm::cross(face.corners[k - 1] - face.corners[0], face.corners[k] - face.corners[0]);
    }
    bulk.area += glm::length(twice_area) / 2;
    bulk.volume += glm::dot(twice_area, face.corners[0] - origin) / 6;
  }
  bulk.middle = origin + bulk.middle / corners;
  return bulk;
}

Cell box_cell(const Vec3& low, const Vec3& high, PlaneTable& planes) {
  const auto corner = [&](int x, int y, int z) {
    return Vec3(x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z);
  };
  const std::vector<std::vector<Vec3>> sides{
      {corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0)},
      {corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), corner(1, 0, 1)},
      {corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1)},
      {corner(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0)},
      {corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0), corner(1, 0, 0)},
      {corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1)}};
  Cell cell;
  for (int side = 0; side < 6; ++side) {
    Plane plane;
    plane.normal[side / 2] = side % 2 == 0 ? -1 : 1;
    plane.offset = side % 2 == 0 ? -low[side / 2] : high[side / 2];
    const auto& corners = sides[static_cast<std::size_t>(side)];
    cell.faces.push_back({corners, planes.number(plane, corners)});
  }
  return cell;
}

CutCell cut(Cell&& cell, std::uint32_t plane, const PlaneTable& planes) {
  CutCell halves;
  const Extent extent = extent_of(cell.faces, planes[plane]);
  Cutter cutter(plane, planes);
  if (extent.high <= planes.tolerance() || extent.low >= -planes.tolerance()) {
    Cell& side = extent.high <= planes.tolerance() ? halves.below : halves.above;
    side.faces = std::move(cell.faces);
    std::vector<CellPolygon> none;
    cutter.divide(cell.surface, side.surface, side.surface, false);
    return halves;
  }
  cutter.divide(cell.faces, halves.below.faces, halves.above.faces, true);
  const std::vector<Vec3> cap = cutter.cap();
  if (cap.size() >= 3) {
    halves.below.faces.push_back({cap, {plane, false}});
    halves.above.faces.push_back({{cap.rbegin(), cap.rend()}, {plane, true}});
  }
  cutter.divide(cell.surface, halves.below.surface, halves.above.surface, false);
  return halves;
}

PlaneSide PlaneTable::number(const Plane& plane, std::span<const Vec3> points) {
  // Small polygons fit many planes within the tolerance: those are told apart by their normals.
  constexpr double kSameDirection = 0.99;
  for (std::uint32_t i = 0; i < size(); ++i) {
    const double turned = glm::dot(planes_[i].normal, plane.normal);
    if (std::abs(turned) < kSameDirection) continue;
    const bool on = std::all_of(points.begin(), points.end(), [&](const Vec3& point) {
      return std::abs(planes_[i].height(point)) <= tolerance_;
    });
    if (on) return {i, turned < 0};
  }
  planes_.push_back(plane);
  return {size() - 1, false};
}

SolidBulk bulk_of(const TriangleSurface& surface) {
  SolidBulk bulk;
  for (const auto& [a, b, c] : surface) {
    const Vec3 twice_area = glm::cross(b - a, c - a);
    bulk.area += glm::length(twice_area) / 2;
    // From a corner of the solid: far from the origin the terms would cancel.
    bulk.volume += glm::dot(twice_area, a - surface[0][0]) / 6;
  }
  return bulk;
}

double winding_number(const TriangleSurface& surface, const Vec3& point) {
  double angle = 0;
  for (const auto& triangle : surface) {
    const Vec3 a = triangle[0] - point, b = triangle[1] - point, c = triangle[2] - point;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double over =
        la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    angle += std::atan2(glm::dot(a, glm::cross(b, c)), over);
  }
  return angle / (2 * std::numbers::pi);
}

}  // namespace palpate::stimuli
