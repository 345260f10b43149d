#pragma once
// The whole segment as what touches: tip and side. Included by what instantiates ticks.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/tick.h"

namespace palpate::rendering::tick {

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

  /// Keeps what has height + (t - at) slope >= 0. Written as selections: on a fine mesh the signs
  /// change from tick to tick, and a branch that is guessed wrong costs more than the whole clip.
  void clip(double height, double slope, double at = 0) {
    const double t =
        at - height / slope;  // of a slope of 0 infinite or undefined, and not selected
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
inline Portion touching_portion(const stimuli::ConvexMesh& mesh, std::uint32_t index,
                                const Vec3& ideal_tip, const Vec3& d) {
  const stimuli::Facet& facet = mesh.facets()[index];
  Portion portion;
  if (facet.side_count == 3) {
    // In the face's plane, inside of a side is below the plane of the facet beyond it.
    const Vec3 a = ideal_tip - (glm::dot(facet.normal, ideal_tip) - facet.offset) * facet.normal;
    const Vec3 along = d - glm::dot(facet.normal, d) * facet.normal;
    for (const stimuli::Neighbour& next : facet.triangle) {
      const stimuli::Facet& across = mesh.facets()[next.across];
      portion.clip(across.offset - glm::dot(across.normal, a), -glm::dot(across.normal, along));
    }
    return portion;
  }
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const stimuli::Side& side = mesh.sides()[i];
    portion.clip(glm::dot(side.inward, ideal_tip) - side.offset, glm::dot(side.inward, d));
  }
  return portion;
}

/// The same for a probe that crosses an edge of the face, a triangle: there it enters or leaves.
/// The other two sides are measured from the crossing, which is known sooner than the ideal tip.
/// No branches: from edge to edge they could not be guessed.
/// \param on_left  whether the face is the one on the edge's left; \param rise  dot(its normal, d)
inline Portion portion_from_edge(const stimuli::ConvexMesh& mesh, const WalkResult& hit,
                                 bool on_left, double rise, const Vec3& d) {
  const stimuli::Edge& edge = mesh.edges()[hit.facet.index];
  const stimuli::Facet& facet = mesh.facets()[on_left ? edge.left : edge.right];
  const Vec3 crossing = edge.from + hit.along_edge * (edge.to - edge.from);
  const Vec3 along = d - rise * facet.normal;
  const double enters = on_left == hit.facet.left_ahead ? 1 : 0;
  Portion portion{std::min(hit.place, enters), std::max(hit.place, enters)};
  const auto& sides = facet.triangle;
  const unsigned here =
      unsigned{sides[1].edge == hit.facet.index} + 2 * unsigned{sides[2].edge == hit.facet.index};
  constexpr std::array<std::uint8_t, 4> kSides{1, 2, 0, 1};
  for (const unsigned other : {kSides[here], kSides[here + 1]}) {
    const stimuli::Facet& across = mesh.facets()[sides[other].across];
    portion.clip(across.offset - glm::dot(across.normal, crossing), -glm::dot(across.normal, along),
                 hit.place);
  }
  return portion;
}

/// The whole segment.
struct SegmentProbe {
  static constexpr bool kSegment = true;

  static Approach approach(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                           const LineProbe& before, const LineProbe& after) {
    return approach_segment(mesh, start, before, after);
  }

  static FirstContact first_contact(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                    const LineProbe& before, const LineProbe& after,
                                    double tolerance) {
    return first_contact_segment(mesh, trees, before, after, tolerance);
  }

  /// Type of the contact and its place along the probe. Frame of the mesh.
  [[gnu::always_inline]] static void describe(const stimuli::ConvexMesh& mesh,
                                              const WalkResult& hit, const Vec3& tip, const Vec3& d,
                                              double length, LoadedContact& c) {
    const bool edge = hit.facet.kind == MinkowskiFacet::Kind::edge;
    c.contact.type = edge ? ContactType::segment_edge : ContactType::point_polygon;
    c.place = hit.place;
    std::uint32_t face = hit.facet.index;
    double rise = 0;
    bool on_left = false;
    if (edge) {
      // Of its two faces the one that the probe is nearer to parallel with.
      const stimuli::Edge& e = mesh.edges()[hit.facet.index];
      const double left = glm::dot(mesh.facets()[e.left].normal, d);
      const double right = glm::dot(mesh.facets()[e.right].normal, d);
      on_left = std::abs(left) <= std::abs(right);
      // A selection; as ?: it would become a branch, which cannot be guessed.
      face = e.right ^ ((e.left ^ e.right) & (0u - unsigned{on_left}));
      rise = on_left ? left : right;
    } else {
      rise = glm::dot(mesh.facets()[face].normal, d);
    }
    if (std::abs(rise) > kSinEpsilon * length || length == 0) return;
    // Equation (2): the contact point glides from one end of the touching portion to the other
    // while the probe turns through the face, instead of jumping. Depth and normal stay those of
    // the facet.
    const auto [enter, leave] = edge && mesh.facets()[face].side_count == 3
                                    ? portion_from_edge(mesh, hit, on_left, rise, d)
                                    : touching_portion(mesh, face, tip + hit.depth * hit.normal, d);
    if (!(enter <= leave)) return;
    const double turned = small_asin(rise / length) * (0.5 / kEpsilon);  // -0.5 to 0.5
    c.place = std::clamp((0.5 + turned) * enter + (0.5 - turned) * leave, enter, leave);
    c.contact.type = ContactType::segment_face;
  }
};

}  // namespace palpate::rendering::tick
