#include "runner/evidence/verification/reference.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {

namespace {

// An edge this nearly parallel to the probe is not a contact edge: the parallelogram that the two
// span has no width.
constexpr double kParallelSine = 1e-9;

// Depths up to this fraction of the object's size count as touching, not as penetrating: an ideal
// probe resting on a facet carries rounding errors of this order when it is far from the origin.
constexpr double kTouchingDepth = 1e-12;

double point_segment_distance(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = glm::dot(ab, ab);
  const double t = length2 > 0 ? std::clamp(glm::dot(p - a, ab) / length2, 0.0, 1.0) : 0.0;
  return glm::length(p - (a + t * ab));
}

// Every candidate is a distance between two points of the segments, so rounding in the nearly
// parallel case can make a candidate useless, but never the result too small.
double segment_distance(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
  double nearest =
      std::min({point_segment_distance(a0, b0, b1), point_segment_distance(a1, b0, b1),
                point_segment_distance(b0, a0, a1), point_segment_distance(b1, a0, a1)});
  const Vec3 a = a1 - a0;
  const Vec3 b = b1 - b0;
  const Vec3 between = b0 - a0;
  const Vec3 across = glm::cross(a, b);
  const double across2 = glm::dot(across, across);
  if (across2 > 0) {
    const double s = std::clamp(glm::dot(glm::cross(between, b), across) / across2, 0.0, 1.0);
    const double t = std::clamp(glm::dot(glm::cross(between, a), across) / across2, 0.0, 1.0);
    nearest = std::min(nearest, glm::length(a0 + s * a - (b0 + t * b)));
  }
  return nearest;
}

// Whether some part of the segment lies in every half-space of the mesh.
bool overlaps(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe) {
  double enters = 0;
  double leaves = 1;
  for (const stimuli::Facet& facet : mesh.facets()) {
    const double tip_height = glm::dot(facet.normal, probe.tip) - facet.offset;
    const double tail_height = glm::dot(facet.normal, probe.tail) - facet.offset;
    if (tip_height > 0 && tail_height > 0) return false;
    if (tip_height > 0) enters = std::max(enters, tip_height / (tip_height - tail_height));
    if (tail_height > 0) leaves = std::min(leaves, tip_height / (tip_height - tail_height));
  }
  return enters <= leaves;
}

bool projects_into(const stimuli::ConvexMesh& mesh, const stimuli::Facet& facet,
                   const Vec3& point) {
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const stimuli::Side& side = mesh.sides()[i];
    if (glm::dot(side.inward, point) < side.offset) return false;
  }
  return true;
}

rendering::LineProbe probe_between(const rendering::LineProbe& before,
                                   const rendering::LineProbe& after, double time) {
  return {before.tip + time * (after.tip - before.tip),
          before.tail + time * (after.tail - before.tail)};
}

}  // namespace

ReferenceDepth reference_depth(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe) {
  ReferenceDepth least{std::numeric_limits<double>::infinity(), Vec3()};
  for (const stimuli::Facet& facet : mesh.facets()) {
    const double deeper_end =
        std::min(glm::dot(facet.normal, probe.tip), glm::dot(facet.normal, probe.tail));
    const double depth = facet.offset - deeper_end;
    if (depth < least.depth) least = {depth, facet.normal};
    if (depth < 0) return least;
  }
  const Vec3 d = probe.tail - probe.tip;
  for (const stimuli::Edge& edge : mesh.edges()) {
    const Vec3& left = mesh.facets()[edge.left].normal;
    const Vec3& right = mesh.facets()[edge.right].normal;
    const double left_slope = glm::dot(left, d);
    const double right_slope = glm::dot(right, d);
    if ((left_slope >= 0) == (right_slope >= 0)) continue;
    const Vec3& v0 = edge.from;
    const Vec3 e = edge.to - v0;
    if (glm::length(glm::cross(e, d)) <= kParallelSine * glm::length(e) * glm::length(d)) continue;
    // The outward direction of e x d, computed as the mixture of the two facet normals that is at
    // right angles to d. It stays on the arc between them, however small e x d is.
    const Vec3 normal = glm::normalize(std::abs(right_slope) * left + std::abs(left_slope) * right);
    const double depth = glm::dot(normal, v0) - glm::dot(normal, probe.tip);
    if (depth < least.depth) least = {depth, normal};
    if (depth < 0) return least;
  }
  return least;
}

double reference_gap(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe) {
  if (overlaps(mesh, probe)) return 0;
  // Two disjoint convex bodies are nearest at an edge and an edge (their ends included) or at an
  // end of the probe and the inside of a facet.
  double gap = std::numeric_limits<double>::infinity();
  for (const stimuli::Edge& edge : mesh.edges()) {
    gap = std::min(gap, segment_distance(probe.tip, probe.tail, edge.from, edge.to));
  }
  for (const stimuli::Facet& facet : mesh.facets()) {
    for (const Vec3& end : {probe.tip, probe.tail}) {
      const double height = glm::dot(facet.normal, end) - facet.offset;
      if (height >= 0 && height < gap && projects_into(mesh, facet, end)) gap = height;
    }
  }
  return gap;
}

std::optional<double> reference_first_contact(const stimuli::ConvexMesh& mesh,
                                              const rendering::LineProbe& before,
                                              const rendering::LineProbe& after, int steps) {
  const auto penetrates = [&](double time) {
    return reference_depth(mesh, probe_between(before, after, time)).depth >
           kTouchingDepth * mesh.size();
  };
  if (penetrates(0)) return 0.0;
  for (int step = 1; step <= steps; ++step) {
    double free = static_cast<double>(step - 1) / steps;
    double inside = static_cast<double>(step) / steps;
    if (!penetrates(inside)) continue;
    for (;;) {
      const double middle = free + (inside - free) / 2;
      if (middle <= free || middle >= inside) return inside;
      (penetrates(middle) ? inside : free) = middle;
    }
  }
  return std::nullopt;
}

}  // namespace palpate::runner::evidence
