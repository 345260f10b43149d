#include "stimuli/parts/cutting.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <string>
#include <utility>

#include "stimuli/parts/cutting_planes.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kMostCells = 16 * kMostParts;

std::string place_text(const Vec3& place) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g) m", place.x, place.y, place.z);
  return text;
}

class SolidCutter {
 public:
  SolidCutter(const FacetedSolid& solid, PlaneTable& planes, MeshFaults& faults)
      : solid_(solid), planes_(planes), faults_(faults), cutting_(solid, planes) {}

  std::vector<std::vector<CellPolygon>> run() {
    todo_.push_back(whole());
    while (!todo_.empty() && faults_.empty()) {
      Cell cell = std::move(todo_.back());
      todo_.pop_back();
      if (is_sliver(cell.faces)) continue;
      if (!cell.ridges.empty()) {
        divide(std::move(cell), 0, true);
      } else if (const Conflict conflict = conflict_in(cell); conflict.found) {
        divide(std::move(cell), conflict.plane, false);
      } else {
        finish(std::move(cell));
      }
      if (++cells_ > kMostCells || parts_.size() > kMostParts) {
        faults_.add("too many parts", [] {
          return "expected a solid of at most " + std::to_string(kMostParts) +
                 " convex parts; cut it in a modelling program and give the parts as groups, or "
                 "simplify it";
        });
      }
    }
    return std::move(parts_);
  }

 private:
  struct Conflict {
    bool found = false;
    std::uint32_t plane = 0;
  };

  Cell whole() {
    Vec3 low = solid_.points[0], high = low;
    for (const Vec3& point : solid_.points) {
      low = glm::min(low, point);
      high = glm::max(high, point);
    }
    Cell cell = box_cell(low - Vec3(solid_.size / 8), high + Vec3(solid_.size / 8), planes_);
    cell.surface = solid_.surface;
    for (std::uint32_t e = 0; e < solid_.concave.size(); ++e)
      cell.ridges.push_back({solid_.concave[e].from, solid_.concave[e].to, e});
    return cell;
  }

  // Thinner than the tolerance: its faces cannot be told apart.
  bool is_sliver(const std::vector<CellPolygon>& faces) const {
    if (faces.size() < 4) return true;
    const CellBulk bulk = bulk_of(faces);
    return !(bulk.volume > planes_.tolerance() * bulk.area);
  }

  void divide(Cell&& cell, std::uint32_t plane, bool at_ridge) {
    if (at_ridge) plane = cutting_.best(cell);
    const std::vector<Ridge> ridges = std::move(cell.ridges);
    CutCell halves = cut(std::move(cell), plane, planes_);
    cutting_.divide_ridges(ridges, plane, halves);
    if (halves.below.empty()) {
      halves.above.ridges.insert(halves.above.ridges.end(), halves.below.ridges.begin(),
                                 halves.below.ridges.end());
    } else if (halves.above.empty()) {
      halves.below.ridges.insert(halves.below.ridges.end(), halves.above.ridges.begin(),
                                 halves.above.ridges.end());
    }
    if (!halves.below.empty()) todo_.push_back(std::move(halves.below));
    if (!halves.above.empty()) todo_.push_back(std::move(halves.above));
  }

  using Side = std::pair<std::uint32_t, bool>;  // plane, flipped
  static std::vector<Side> sides_of(const Cell& cell) {
    std::vector<Side> sides;
    for (const CellPolygon& polygon : cell.surface)
      sides.emplace_back(polygon.on.plane, polygon.on.flipped);
    std::sort(sides.begin(), sides.end());
    sides.erase(std::unique(sides.begin(), sides.end()), sides.end());
    return sides;
  }

  // A facet with surface in front of it: they bound different pieces, or one that is not convex.
  Conflict conflict_in(const Cell& cell) const {
    const std::vector<Side> sides = sides_of(cell);
    Conflict conflict;
    std::size_t fewest = 0;
    int looked_at = 0;
    for (std::size_t s = 0; s < sides.size() && looked_at < kTriedConflicts; ++s) {
      const auto [plane, flipped] = sides[s];
      const bool both = s + 1 < sides.size() && sides[s + 1].first == plane;
      std::size_t torn = 0;
      if (!stands_in_front(cell, plane, flipped, torn) && !both) continue;
      ++looked_at;
      if (conflict.found && torn >= fewest) continue;
      conflict = {true, plane};
      fewest = torn;
    }
    return conflict;
  }

  bool stands_in_front(const Cell& cell, std::uint32_t number, bool flipped,
                       std::size_t& torn) const {
    const Plane& plane = planes_[number];
    const double sign = flipped ? -1 : 1;
    bool any = false;
    for (const CellPolygon& polygon : cell.surface) {
      if (polygon.on.plane == number) continue;
      bool front = false, behind = false;
      for (const Vec3& corner : polygon.corners) {
        const double height = sign * plane.height(corner);
        front |= height > planes_.tolerance();
        behind |= height < -planes_.tolerance();
      }
      any |= front;
      torn += front && behind ? 1 : 0;
    }
    return any;
  }

  // The cell behind all facets that it holds; a cell that holds none is all solid or all empty.
  void finish(Cell&& cell) {
    Cell part;
    part.faces = std::move(cell.faces);
    for (const auto& [plane, flipped] : sides_of(cell)) {
      CutCell halves = cut(std::move(part), plane, planes_);
      part = std::move(flipped ? halves.above : halves.below);
      if (part.empty()) return;
    }
    if (is_sliver(part.faces)) return;
    const Vec3 middle = bulk_of(part.faces).middle;
    const double winding = winding_number(solid_.triangles, middle);
    const double times = std::round(winding);
    if (std::abs(winding - times) > 0.01 || times < 0 || times > 1 ||
        (times == 0 && !cell.surface.empty())) {
      faults_.add("cuts itself", [&] {
        char text[32];
        std::snprintf(text, sizeof text, "%.2f", winding);
        return "near " + place_text(middle) + " the surface winds round " + text +
               " times; expected a surface that does not pass through itself (0 outside, 1 inside)";
      });
    }
    if (times == 1) parts_.push_back(std::move(part.faces));
  }

  static constexpr int kTriedConflicts = 8;

  const FacetedSolid& solid_;
  PlaneTable& planes_;
  MeshFaults& faults_;
  CuttingPlanes cutting_;
  std::vector<Cell> todo_;
  std::vector<std::vector<CellPolygon>> parts_;
  std::size_t cells_ = 0;
};

}  // namespace

std::vector<std::vector<CellPolygon>> cut_at_concave_edges(const FacetedSolid& solid,
                                                           PlaneTable& planes, MeshFaults& faults) {
  if (solid.concave.size() > kMostConcaveEdges) {
    faults.add("too many concave edges", [&] {
      return "expected at most " + std::to_string(kMostConcaveEdges) + ", found " +
             std::to_string(solid.concave.size()) +
             "; simplify the mesh, or give convex parts as groups";
    });
    return {};
  }
  return SolidCutter(solid, planes, faults).run();
}

}  // namespace palpate::stimuli
