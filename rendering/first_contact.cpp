#include "rendering/first_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

// Ho, Basdogan & Srinivasan 2000, 4(a), appendix 7 and 8. Departs: appendix 8 holds for small
// motions only; here the time of crossing is the root of a quadratic, so fast motions are caught,
// too.

using Kind = ContactFeature::Kind;

/// Whether the segment a .. a + d meets the box low .. high.
bool segment_meets_box(const Vec3& a, const Vec3& d, const Vec3& low, const Vec3& high) {
  double enter = 0, leave = 1;
  for (int k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (a[k] < low[k] || a[k] > high[k]) return false;
      continue;
    }
    const double inverse = 1 / d[k];
    double t0 = (low[k] - a[k]) * inverse, t1 = (high[k] - a[k]) * inverse;
    if (t0 > t1) std::swap(t0, t1);
    enter = std::max(enter, t0);
    leave = std::min(leave, t1);
    if (enter > leave) return false;
  }
  return true;
}

/// Calls visit(primitive) for all primitives whose box the segment a .. a + d can meet under a
/// translation between `low_shift` and `high_shift`.
template <class Visit>
void visit_near(const stimuli::BoundingTree* tree, std::size_t primitives, const Vec3& a,
                const Vec3& d, const Vec3& low_shift, const Vec3& high_shift, Visit visit) {
  if (!tree) {
    for (std::uint32_t i = 0; i < primitives; ++i) visit(i);
    return;
  }
  std::array<std::uint32_t, 64> stack;  // depth of a median-split tree: at most 32
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const std::uint32_t index = stack[--top];
    const stimuli::BoundingTree::Node& node = tree->nodes()[index];
    if (!segment_meets_box(a, d, node.box.low - high_shift, node.box.high - low_shift)) continue;
    if (node.count > 0) {
      for (std::uint32_t i = 0; i < node.count; ++i) visit(tree->order()[node.first + i]);
    } else {
      stack[top++] = node.first;
      stack[top++] = index + 1;
    }
  }
}

/// An end point moving from a to b against one polygon (appendix 7).
void meet_polygon(const stimuli::ConvexMesh& mesh, std::uint32_t index, const Vec3& a,
                  const Vec3& b, double tolerance, FirstContact& first) {
  const stimuli::Facet& facet = mesh.facets()[index];
  const double before = glm::dot(facet.normal, a) - facet.offset;
  const double after = glm::dot(facet.normal, b) - facet.offset;
  if (!(after < 0) || before < -tolerance || !(after < before)) return;
  const double time = std::max(0.0, before / (before - after));
  if (time >= first.time) return;
  const Vec3 p = a + time * (b - a);
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    if (glm::dot(mesh.sides()[i].inward, p) < mesh.sides()[i].offset - tolerance) return;
  }
  first = {{Kind::facet, false, index}, time};
}

/// The moving segment as linear functions of the time t in [0, 1]; d = tail - tip.
struct MovingSegment {
  Vec3 tip, tip_motion, d, d_motion;
};

/// The moving segment against one edge (appendix 8, made exact).
void meet_edge(const stimuli::ConvexMesh& mesh, std::uint32_t index, const MovingSegment& probe,
               double tolerance, FirstContact& first) {
  const stimuli::Edge& edge = mesh.edges()[index];
  const Vec3& v0 = edge.from;
  const Vec3 e = edge.to - v0;
  const Vec3 w = probe.tip - v0;
  // (w(t) x d(t)) . e = 0: probe and edge are in one plane
  const double c0 = glm::dot(glm::cross(w, probe.d), e);
  const double c1 =
      glm::dot(glm::cross(probe.tip_motion, probe.d) + glm::cross(w, probe.d_motion), e);
  const double c2 = glm::dot(glm::cross(probe.tip_motion, probe.d_motion), e);
  std::array<double, 2> roots;
  int count = 0;
  const double discriminant = c1 * c1 - 4 * c2 * c0;
  if (!(discriminant >= 0)) return;
  const double q = -0.5 * (c1 + std::copysign(std::sqrt(discriminant), c1));
  if (c2 != 0) roots[count++] = q / c2;
  if (q != 0) roots[count++] = c0 / q;
  for (int k = 0; k < count; ++k) {
    constexpr double kEarly = 1e-9;  // of a tick; a probe that left by rounding is at the surface
    if (!(roots[k] >= -kEarly && roots[k] <= 1)) continue;
    const double time = std::max(0.0, roots[k]);
    if (time >= first.time) continue;
    const Vec3 d = probe.d + time * probe.d_motion;
    const Vec3 at = w + time * probe.tip_motion;
    const double left = glm::dot(mesh.facets()[edge.left].normal, d);
    const double right = glm::dot(mesh.facets()[edge.right].normal, d);
    if ((left >= 0) == (right >= 0)) continue;
    const bool left_ahead = left >= 0;
    // Entering: the height over the edge, -(w x d).e / |e x d| for left_ahead, else its negative,
    // must fall.
    const double rate = c1 + 2 * c2 * time;
    if (!(left_ahead ? rate > 0 : rate < 0)) continue;
    const Vec3 c = glm::cross(e, d);
    const double n2 = glm::dot(c, c);
    const double e2 = glm::dot(e, e), d2 = glm::dot(d, d);
    if (n2 <= 1e-18 * e2 * d2) continue;
    const double probe_fraction = glm::dot(glm::cross(at, e), c) / n2;
    const double edge_fraction = glm::dot(glm::cross(at, d), c) / n2;
    const double probe_slack = tolerance / std::sqrt(d2), edge_slack = tolerance / std::sqrt(e2);
    if (probe_fraction < -probe_slack || probe_fraction > 1 + probe_slack) continue;
    if (edge_fraction < -edge_slack || edge_fraction > 1 + edge_slack) continue;
    first = {{Kind::edge, left_ahead, index}, time};
  }
}

void meet_polygons(const stimuli::ConvexMesh& mesh, const ContactTrees& trees, const Vec3& a,
                   const Vec3& b, double tolerance, FirstContact& first) {
  visit_near(trees.polygons(), mesh.facets().size(), a, b - a, Vec3(-tolerance), Vec3(tolerance),
             [&](std::uint32_t i) { meet_polygon(mesh, i, a, b, tolerance, first); });
}

/// Whether two large faces meet at less than twice the blend angle (kBlendAngle). Over small faces
/// a jump of the equivalent point of (2) is too short to be felt.
bool has_shallow_ridges(const stimuli::ConvexMesh& mesh) {
  constexpr double kCosine = 0.99939082701909573;  // of 2 degrees
  constexpr double kLarge = 1.0 / 16;              // of the size
  const auto large = [&](std::uint32_t index) {
    const stimuli::Facet& facet = mesh.facets()[index];
    const Vec3& from = mesh.edges()[mesh.sides()[facet.first_side].edge].from;
    double farthest2 = 0;
    for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
      const stimuli::Edge& edge = mesh.edges()[mesh.sides()[i].edge];
      const Vec3 to_one = edge.from - from, to_other = edge.to - from;
      farthest2 = std::max({farthest2, glm::dot(to_one, to_one), glm::dot(to_other, to_other)});
    }
    return farthest2 > kLarge * kLarge * mesh.size() * mesh.size();
  };
  for (const stimuli::Edge& edge : mesh.edges()) {
    if (glm::dot(mesh.facets()[edge.left].normal, mesh.facets()[edge.right].normal) > kCosine &&
        large(edge.left) && large(edge.right))
      return true;
  }
  return false;
}

}  // namespace

ContactTrees::ContactTrees(const stimuli::ConvexMesh& mesh, bool with_edges, std::size_t scan_limit,
                           std::size_t small_mesh)
    : support_map_(mesh, small_mesh),
      facet_map_(mesh, small_mesh),
      shallow_ridges_(with_edges && has_shallow_ridges(mesh)) {
  if (mesh.facets().size() > scan_limit) {
    std::vector<stimuli::Box> boxes;
    boxes.reserve(mesh.facets().size());
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
      const stimuli::Facet& facet = mesh.facets()[f];
      stimuli::Box box;
      for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
        const stimuli::Edge& edge = mesh.edges()[mesh.sides()[i].edge];
        for (const std::uint32_t v : {edge.v0, edge.v1}) box.add(mesh.vertices()[v]);
      }
      boxes.push_back(box);
    }
    polygons_ = stimuli::BoundingTree(boxes);
  }
  if (with_edges && mesh.edges().size() > scan_limit) {
    std::vector<stimuli::Box> boxes;
    boxes.reserve(mesh.edges().size());
    for (const stimuli::Edge& edge : mesh.edges()) {
      const Vec3 &a = edge.from, &b = edge.to;
      boxes.push_back({glm::min(a, b), glm::max(a, b)});
    }
    edges_ = stimuli::BoundingTree(boxes);
  }
}

FirstContact first_contact_segment(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                   const LineProbe& before, const LineProbe& after,
                                   double tolerance) {
  FirstContact first;
  meet_polygons(mesh, trees, before.tip, after.tip, tolerance, first);
  meet_polygons(mesh, trees, before.tail, after.tail, tolerance, first);
  const Vec3 tip_motion = after.tip - before.tip, tail_motion = after.tail - before.tail;
  const MovingSegment probe{before.tip, tip_motion, before.tail - before.tip,
                            tail_motion - tip_motion};
  const Vec3 zero(0);
  const Vec3 low = glm::min(glm::min(tip_motion, tail_motion), zero) - tolerance;
  const Vec3 high = glm::max(glm::max(tip_motion, tail_motion), zero) + tolerance;
  visit_near(trees.edges(), mesh.edges().size(), probe.tip, probe.d, low, high,
             [&](std::uint32_t i) { meet_edge(mesh, i, probe, tolerance, first); });
  return first;
}

FirstContact first_contact_point(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                 const Vec3& before, const Vec3& after, double tolerance) {
  FirstContact first;
  meet_polygons(mesh, trees, before, after, tolerance, first);
  return first;
}

}  // namespace palpate::rendering
