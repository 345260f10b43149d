#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/mesh_names.h"
#include "stimuli/parts/facets.h"

namespace palpate::stimuli {
namespace {

// Which plane to cut a cell of a concave solid by next.

/// Any plane through a concave edge that runs on into the notch leaves convex corners on both
/// sides. Those of the two facets do; so does the one that halves the notch, and planes that hold
/// further concave edges do the work of several.
class CuttingPlanes {
 public:
  /// Adds its planes to the table. `solid` must outlive it.
  CuttingPlanes(const FacetedSolid& solid, PlaneTable& planes);

  /// The plane that splits most concave edges of the cell and tears fewest others.
  std::uint32_t best(const Cell& cell) const;

  /// Passes the ridges of a cell cut by a plane on to its halves; drops those that are convex in
  /// both.
  void divide_ridges(const std::vector<Ridge>& ridges, std::uint32_t plane, CutCell& halves) const;

 private:
  void add(std::uint32_t edge, const Vec3& normal, std::vector<Vec3> points);
  void add_pair(std::uint32_t a, std::uint32_t b);
  double gain(std::uint32_t edge, std::uint32_t plane) const;

  const FacetedSolid& solid_;
  PlaneTable& planes_;
  std::vector<std::vector<std::uint32_t>> through_;  // of each concave edge
};

constexpr std::size_t kAllPairs = 96;    // concave edges; up to so many, try every pair
constexpr std::size_t kTriedEdges = 48;  // of a cell, whose planes are tried
constexpr double kRounding = 1e-9;       // of a sine
constexpr double kThin = 0.03;           // rad; a part with a sharper edge is a last resort
constexpr double kTorn = 0.5;            // what a torn edge costs, in edges that are cut apart
constexpr double kTornPolygon = 1e-3;    // and a torn polygon

Vec3 along(const ConcaveEdge& edge) { return glm::normalize(edge.to - edge.from); }

// The least angle of the two pieces of solid that a plane leaves at a concave edge; negative where
// the plane does not run into the notch. `into` is unit, in the plane, across the edge.
double least_angle(const ConcaveEdge& edge, const Vec3& into) {
  if (glm::dot(edge.left, into) < -kRounding || glm::dot(edge.right, into) < -kRounding) return -1;
  const Vec3 t = along(edge);
  const Vec3 to_left = glm::cross(edge.left, t), to_right = glm::cross(t, edge.right);
  const double wider = std::min(glm::dot(to_left, into), glm::dot(to_right, into));
  return std::numbers::pi - std::acos(std::clamp(wider, -1.0, 1.0));
}

// How well a plane that contains the edge splits it: 1 well, 0 not at all.
double gain_of(const ConcaveEdge& edge, const Plane& plane) {
  const Vec3 across = glm::normalize(glm::cross(plane.normal, along(edge)));
  const double angle = std::max(least_angle(edge, across), least_angle(edge, -across));
  if (angle < 0) return 0;
  return angle < kThin ? 0.1 : 1;
}

CuttingPlanes::CuttingPlanes(const FacetedSolid& solid, PlaneTable& planes)
    : solid_(solid), planes_(planes), through_(solid.concave.size()) {
  std::vector<std::vector<std::uint32_t>> at(solid.points.size());  // concave edges at each corner
  for (std::uint32_t e = 0; e < solid.concave.size(); ++e) {
    const ConcaveEdge& edge = solid.concave[e];
    through_[e] = {edge.on[0].plane, edge.on[1].plane};
    const Vec3 t = along(edge), into = edge.left + edge.right;
    if (glm::length(into) > kRounding) {
      const Vec3 far = edge.from + solid.size * glm::normalize(into);
      add(e, glm::cross(t, into), {edge.from, edge.to, far});
    }
    for (const std::uint32_t end : edge.ends) at[end].push_back(e);
  }
  if (solid.concave.size() <= kAllPairs) {
    for (std::uint32_t a = 0; a < solid.concave.size(); ++a) {
      for (std::uint32_t b = a + 1; b < solid.concave.size(); ++b) add_pair(a, b);
    }
    return;
  }
  for (const auto& edges : at) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      for (std::size_t j = i + 1; j < std::min(edges.size(), i + 4); ++j)
        add_pair(edges[i], edges[j]);
    }
  }
}

void CuttingPlanes::add(std::uint32_t edge, const Vec3& normal, std::vector<Vec3> points) {
  const Vec3 unit = glm::normalize(normal);
  const PlaneSide side = planes_.number({unit, glm::dot(unit, points[0])}, points);
  std::vector<std::uint32_t>& list = through_[edge];
  if (std::find(list.begin(), list.end(), side.plane) == list.end()) list.push_back(side.plane);
}

// The plane that holds two edges, where there is one and it runs into both notches.
void CuttingPlanes::add_pair(std::uint32_t a, std::uint32_t b) {
  const ConcaveEdge &one = solid_.concave[a], &other = solid_.concave[b];
  // Across their ends: parallel edges span a plane as well.
  Vec3 normal = glm::cross(one.to - one.from, other.to - one.from);
  const Vec3 second = glm::cross(one.to - one.from, other.from - one.from);
  if (glm::length(second) > glm::length(normal)) normal = second;
  if (!(glm::length(normal) > 1e-6 * solid_.size * solid_.size)) return;
  const Plane plane{glm::normalize(normal), glm::dot(glm::normalize(normal), one.from)};
  if (std::abs(plane.height(other.from)) > planes_.tolerance() ||
      std::abs(plane.height(other.to)) > planes_.tolerance())
    return;
  if (gain_of(one, plane) <= 0 || gain_of(other, plane) <= 0) return;
  add(a, plane.normal, {one.from, one.to, other.from, other.to});
  add(b, plane.normal, {one.from, one.to, other.from, other.to});
}

// The gain of a plane that contains the edge. A plane listed for the edge splits it, if only within
// the tolerance.
double CuttingPlanes::gain(std::uint32_t edge, std::uint32_t plane) const {
  const auto& list = through_[edge];
  const bool listed = std::find(list.begin(), list.end(), plane) != list.end();
  return std::max(gain_of(solid_.concave[edge], planes_[plane]), listed ? 0.1 : 0);
}

std::uint32_t CuttingPlanes::best(const Cell& cell) const {
  std::vector<std::uint32_t> tried;
  const std::size_t stride = 1 + cell.ridges.size() / kTriedEdges;
  for (std::size_t i = 0; i < cell.ridges.size(); i += stride) {
    const auto& list = through_[cell.ridges[i].edge];
    tried.insert(tried.end(), list.begin(), list.end());
  }
  std::sort(tried.begin(), tried.end());
  tried.erase(std::unique(tried.begin(), tried.end()), tried.end());
  const double on = planes_.tolerance();
  std::uint32_t best = tried[0];
  double highest = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t candidate : tried) {
    const Plane& plane = planes_[candidate];
    double score = 0;
    for (const Ridge& ridge : cell.ridges) {
      const double from = plane.height(ridge.from), to = plane.height(ridge.to);
      if (std::abs(from) <= on && std::abs(to) <= on) {
        score += gain(ridge.edge, candidate);
      } else if ((from < -on && to > on) || (from > on && to < -on)) {
        score -= kTorn;
      }
    }
    if (score <= highest) continue;  // torn polygons only add cost
    for (const CellPolygon& polygon : cell.surface) {
      if (polygon.on.plane == candidate) continue;
      bool below = false, above = false;
      for (const Vec3& corner : polygon.corners) {
        const double height = plane.height(corner);
        below |= height < -on;
        above |= height > on;
      }
      if (below && above) score -= kTornPolygon;
    }
    if (score <= highest) continue;
    highest = score;
    best = candidate;
  }
  return best;
}

void CuttingPlanes::divide_ridges(const std::vector<Ridge>& ridges, std::uint32_t number,
                                  CutCell& halves) const {
  const Plane& plane = planes_[number];
  const double on = planes_.tolerance();
  for (const Ridge& ridge : ridges) {
    const ConcaveEdge& edge = solid_.concave[ridge.edge];
    const double from = plane.height(ridge.from), to = plane.height(ridge.to);
    if (std::abs(from) <= on && std::abs(to) <= on) {
      if (gain(ridge.edge, number) > 0) continue;
      // The notch is on one side, the other is a flat wall.
      const bool above = glm::dot(edge.left + edge.right, plane.normal) > 0;
      (above ? halves.above : halves.below).ridges.push_back(ridge);
    } else if (from <= on && to <= on) {
      halves.below.ridges.push_back(ridge);
    } else if (from >= -on && to >= -on) {
      halves.above.ridges.push_back(ridge);
    } else {
      const Vec3 middle = ridge.from + (ridge.to - ridge.from) * (from / (from - to));
      const bool rises = from < 0;
      halves.below.ridges.push_back(rises ? Ridge{ridge.from, middle, ridge.edge}
                                          : Ridge{middle, ridge.to, ridge.edge});
      halves.above.ridges.push_back(rises ? Ridge{middle, ridge.to, ridge.edge}
                                          : Ridge{ridge.from, middle, ridge.edge});
    }
  }
}

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

  // The cell behind all facets in it; a cell without facets is all solid or all empty.
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
