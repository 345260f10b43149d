#include "stimuli/parts/cutting_planes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

namespace palpate::stimuli {
namespace {

constexpr std::size_t kAllPairs = 96;    // concave edges, up to which every two are tried together
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

// Of a plane that holds the edge: 1 where it cuts it apart well, 0 where not at all.
double gain_of(const ConcaveEdge& edge, const Plane& plane) {
  const Vec3 across = glm::normalize(glm::cross(plane.normal, along(edge)));
  const double angle = std::max(least_angle(edge, across), least_angle(edge, -across));
  if (angle < 0) return 0;
  return angle < kThin ? 0.1 : 1;
}

}  // namespace

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

// Of a plane that holds the edge. One that was listed for it cuts it apart, if only within the
// tolerance.
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
    if (score <= highest) continue;  // torn polygons only cost
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

}  // namespace palpate::stimuli
