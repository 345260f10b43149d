#pragma once
// The whole segment as what touches: tip and side. Included by what instantiates ticks.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/tick.h"

namespace palpate::tick {

inline constexpr double kEpsilon =
    std::numbers::pi / 180;  // 1 degree: the paper's choice for segment-face
inline constexpr double kSinEpsilon = 0.01745240643728351;  // std::sin is no constexpr

/// asin by its series: exact to rounding up to epsilon, and much faster than the library's.
inline double small_asin(double x) {
  const double x2 = x * x;
  return x * (1 + x2 * (1.0 / 6 + x2 * (3.0 / 40 + x2 * (5.0 / 112))));
}

/// Part of a segment a + t d, 0 <= t <= 1.
struct Portion {
  double enter = 0, leave = 1;

  /// Keeps what has height + t slope >= 0. Written as selections: on a fine mesh the signs change
  /// from tick to tick, and a branch that is guessed wrong costs more than the whole clip.
  void clip(double height, double slope) {
    const double t = -height / slope;  // of a slope of 0 infinite or undefined, and not selected
    const double from = slope > 0 ? t : 0.0;
    const double to = slope < 0 ? t : 1.0;
    enter = from > enter ? from : enter;
    leave = to < leave ? to : leave;
    const double all = ((slope == 0) & (height < 0)) ? -1.0 : 1.0;
    leave = all < leave ? all : leave;
  }
};

/// Where a probe that lies on a face enters and leaves its polygon, as fractions of the probe;
/// enter > leave when rounding leaves nothing of it on the polygon.
inline Portion touching_portion(const ConvexMesh& mesh, std::uint32_t index, const Vec3& ideal_tip,
                                const Vec3& d) {
  const Facet& facet = mesh.facets()[index];
  Portion portion;
  if (facet.side_count == 3) {
    // In the face's plane, inside of a side is below the plane of the facet beyond it.
    const Vec3 a = ideal_tip - (glm::dot(facet.normal, ideal_tip) - facet.offset) * facet.normal;
    const Vec3 along = d - glm::dot(facet.normal, d) * facet.normal;
    for (const Neighbour& next : facet.triangle) {
      const Facet& across = mesh.facets()[next.across];
      portion.clip(across.offset - glm::dot(across.normal, a), -glm::dot(across.normal, along));
    }
    return portion;
  }
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const Side& side = mesh.sides()[i];
    portion.clip(glm::dot(side.inward, ideal_tip) - side.offset, glm::dot(side.inward, d));
  }
  return portion;
}

/// The whole segment.
struct SegmentProbe {
  static constexpr bool kSegment = true;

  static Approach approach(const ConvexMesh& mesh, MinkowskiFacet start, const LineProbe& before,
                           const LineProbe& after) {
    return approach_segment(mesh, start, before, after);
  }

  static FirstContact first_contact(const ConvexMesh& mesh, const ContactTrees& trees,
                                    const LineProbe& before, const LineProbe& after,
                                    double tolerance) {
    return first_contact_segment(mesh, trees, before, after, tolerance);
  }

  /// Type of the contact and its place along the probe. Frame of the mesh.
  [[gnu::always_inline]] static void describe(const ConvexMesh& mesh, const WalkResult& hit,
                                              const Vec3& tip, const Vec3& d, double length,
                                              LoadedContact& c) {
    const bool edge = hit.facet.kind == MinkowskiFacet::Kind::edge;
    c.contact.type = edge ? ContactType::segment_edge : ContactType::point_polygon;
    c.place = hit.place;
    // Of an edge's two faces the one that the probe is nearer to parallel with.
    std::uint32_t face = hit.facet.index;
    if (edge) {
      const Edge& e = mesh.edges()[hit.facet.index];
      const double left = std::abs(glm::dot(mesh.facets()[e.left].normal, d));
      const double right = std::abs(glm::dot(mesh.facets()[e.right].normal, d));
      face = left <= right ? e.left : e.right;
    }
    const double rise = glm::dot(mesh.facets()[face].normal, d);
    if (std::abs(rise) > kSinEpsilon * length || length == 0) return;
    // Equation (2): the contact point glides from one end of the touching portion to the other
    // while the probe turns through the face, instead of jumping. Depth and normal stay those of
    // the facet.
    const auto [enter, leave] = touching_portion(mesh, face, tip + hit.depth * hit.normal, d);
    if (!(enter <= leave)) return;
    const double theta = small_asin(rise / length);
    const double middle = 0.5 * (enter + leave);
    c.place = std::clamp(middle + theta / kEpsilon * 0.5 * (enter - leave), enter, leave);
    c.contact.type = ContactType::segment_face;
  }
};

}  // namespace palpate::tick
