#pragma once
// The touching part of the probe: the tip alone (point-based rendering) or the whole segment
// (ray-based). Mesh frame. Included only where ticks are instantiated.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/contact.h"
#include "rendering/contact_detection.h"
#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/scene.h"

namespace palpate::rendering::tick {

/// The probe shrunk to its tip.
struct PointProbe {
  static constexpr bool kSegment = false;

  /// \param probe  world frame
  [[gnu::always_inline]] static LineProbe to_local(const ScenePart& part, const LineProbe& probe) {
    const Vec3 tip = part.local_point(probe.tip);
    return {tip, tip};
  }

  static WalkResult walk(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip,
                         const Vec3&) {
    return walk_point(mesh, start, tip);
  }

  static WalkResult same_feature(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                 const Vec3& tip, const Vec3&) {
    return same_feature_point(mesh, start, tip);
  }

  static WalkResult farthest_plane(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                   const Vec3& tip, const Vec3&) {
    return farthest_plane_point(mesh, start, tip);
  }

  static WalkResult nearest_feature(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3&) {
    return nearest_feature_point(mesh, tip);
  }

  static WalkResult holding_feature(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3&,
                                    const Vec3& shift) {
    return holding_feature_point(mesh, tip, shift);
  }

  static Approach approach(const stimuli::ConvexMesh& mesh, ContactFeature start,
                           const LineProbe& before, const LineProbe& after) {
    return approach_point(mesh, start, before, after);
  }

  static FirstContact first_contact(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                    const LineProbe& before, const LineProbe& after,
                                    double tolerance) {
    return first_contact_point(mesh, trees, before.tip, after.tip, tolerance);
  }

  /// Sets the type of the contact, which is at the tip.
  static void classify(const stimuli::ConvexMesh&, const WalkResult&, const Vec3&, const Vec3&,
                       double, LoadedContact& c) {
    c.contact.type = ContactType::point_polygon;
  }
};

// rad, epsilon of equation (2), within which a contact is segment-face: 1 degree, as in the paper.
inline constexpr double kBlendAngle = std::numbers::pi / 180;
inline constexpr double kSinBlendAngle = 0.01745240643728351;  // std::sin is not constexpr

/// asin by its series: exact to rounding up to the blend angle, and much faster than std::asin.
inline double small_asin(double x) {
  const double x2 = x * x;
  return x * (1 + x2 * (1.0 / 6 + x2 * (3.0 / 40 + x2 * (5.0 / 112))));
}

/// A facet with more sides is clipped by bisection (tests/rendering/RESULTS.md).
inline constexpr std::uint32_t kClippedOneByOne = 128;

/// Part of a segment a + t d, 0 <= t <= 1: clipped by half-spaces.
struct Portion {
  double enter = 0, leave = 1;

  /// Keeps the t with height + (t - at) slope >= 0. Branch-free: on a fine mesh the signs change
  /// from tick to tick, and a mispredicted branch costs more than the whole clip.
  void clip(double height, double slope, double at = 0) {
    const double t = at - height / slope;  // of a slope of 0 infinite or NaN: not selected
    const double from = slope > 0 ? t : 0.0;
    const double to = slope < 0 ? t : 1.0;
    enter = from > enter ? from : enter;
    leave = to < leave ? to : leave;
    const double all = ((slope == 0) & (height < 0)) ? -1.0 : 1.0;
    leave = all < leave ? all : leave;
  }

  /// Clips by all sides of a facet, by bisection: the same bits as side by side, quicker from some
  /// hundred sides on.
  /// \param slack  m, by which the sides are moved outwards
  void clip_by_many(const stimuli::ConvexMesh& mesh, std::uint32_t facet, const Vec3& tip,
                    const Vec3& d, double slack);
};

/// The portion over the facet's polygon of a probe that lies on the facet; enter > leave if
/// rounding leaves nothing of it.
inline Portion touching_portion(const stimuli::ConvexMesh& mesh, std::uint32_t index,
                                const Vec3& ideal_tip, const Vec3& d) {
  const stimuli::Facet& facet = mesh.facets()[index];
  Portion portion;
  if (facet.side_count == 3) {
    // Within the facet's plane, the inside of a side is below the plane of the facet beyond it.
    const Vec3 a = ideal_tip - (glm::dot(facet.normal, ideal_tip) - facet.offset) * facet.normal;
    const Vec3 along = d - glm::dot(facet.normal, d) * facet.normal;
    for (const stimuli::Neighbour& next : facet.triangle) {
      const stimuli::Facet& across = mesh.facets()[next.across];
      portion.clip(across.offset - glm::dot(across.normal, a), -glm::dot(across.normal, along));
    }
    return portion;
  }
  if (facet.side_count > kClippedOneByOne) {
    portion.clip_by_many(mesh, index, ideal_tip, d, 0);
    return portion;
  }
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const stimuli::Side& side = mesh.sides()[i];
    portion.clip(glm::dot(side.inward, ideal_tip) - side.offset, glm::dot(side.inward, d));
  }
  return portion;
}

/// The same for a probe that crosses an edge of the facet, a triangle: there it enters or leaves.
/// The other two sides are measured from the crossing, which is known sooner than the ideal tip.
/// Branch-free, as above.
/// \param on_left  whether the facet is the one on the edge's left
/// \param slope    dot(its normal, d)
inline Portion portion_from_edge(const stimuli::ConvexMesh& mesh, const WalkResult& hit,
                                 bool on_left, double slope, const Vec3& d) {
  const stimuli::Edge& edge = mesh.edges()[hit.feature.index];
  const stimuli::Facet& facet = mesh.facets()[on_left ? edge.left : edge.right];
  const Vec3 crossing = edge.from + hit.edge_fraction * (edge.to - edge.from);
  const Vec3 along = d - slope * facet.normal;
  const double enters = on_left == hit.feature.left_ahead ? 1 : 0;
  Portion portion{std::min(hit.probe_fraction, enters), std::max(hit.probe_fraction, enters)};
  const auto& sides = facet.triangle;
  const unsigned here = unsigned{sides[1].edge == hit.feature.index} +
                        2 * unsigned{sides[2].edge == hit.feature.index};
  constexpr std::array<std::uint8_t, 4> kSides{1, 2, 0, 1};
  for (const unsigned other : {kSides[here], kSides[here + 1]}) {
    const stimuli::Facet& across = mesh.facets()[sides[other].across];
    portion.clip(across.offset - glm::dot(across.normal, crossing), -glm::dot(across.normal, along),
                 hit.probe_fraction);
  }
  return portion;
}

/// m, the part of the segment over which a textured face is felt: that of the uniform pressure
/// about the point of equation (2). It begins at the deeper end of the portion over the face.
inline Vec3 pressed_window(const stimuli::ConvexMesh& mesh, const WalkResult& hit, const Vec3& tip,
                           const Vec3& d, double probe_fraction) {
  std::uint32_t facet = hit.feature.index;
  if (hit.feature.kind == ContactFeature::Kind::edge) {
    const stimuli::Edge& edge = mesh.edges()[hit.feature.index];
    const double left = glm::dot(mesh.facets()[edge.left].normal, d);
    const double right = glm::dot(mesh.facets()[edge.right].normal, d);
    facet = std::abs(left) <= std::abs(right) ? edge.left : edge.right;
  }
  const Portion portion = touching_portion(mesh, facet, tip + hit.depth * hit.normal, d);
  const double share = 2 * std::min(probe_fraction - portion.enter, portion.leave - probe_fraction);
  return std::max(0.0, share) * (d - glm::dot(d, hit.normal) * hit.normal);
}

/// The whole segment touches, tip and side.
struct SegmentProbe {
  static constexpr bool kSegment = true;

  /// \param probe  world frame
  [[gnu::always_inline]] static LineProbe to_local(const ScenePart& part, const LineProbe& probe) {
    return {part.local_point(probe.tip), part.local_point(probe.tail)};
  }

  static WalkResult walk(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip,
                         const Vec3& d) {
    return walk_segment(mesh, start, tip, d);
  }

  static WalkResult same_feature(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                 const Vec3& tip, const Vec3& d) {
    return same_feature_segment(mesh, start, tip, d);
  }

  static WalkResult farthest_plane(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                   const Vec3& tip, const Vec3& d) {
    return farthest_plane_segment(mesh, start, tip, d);
  }

  static WalkResult nearest_feature(const stimuli::ConvexMesh& mesh, const Vec3& tip,
                                    const Vec3& d) {
    return nearest_feature_segment(mesh, tip, d);
  }

  static WalkResult holding_feature(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                                    const Vec3& shift) {
    return holding_feature_segment(mesh, tip, d, shift);
  }

  static Approach approach(const stimuli::ConvexMesh& mesh, ContactFeature start,
                           const LineProbe& before, const LineProbe& after) {
    return approach_segment(mesh, start, before, after);
  }

  static FirstContact first_contact(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                    const LineProbe& before, const LineProbe& after,
                                    double tolerance) {
    return first_contact_segment(mesh, trees, before, after, tolerance);
  }

  /// Sets the type of the contact and its place on the probe.
  [[gnu::always_inline]] static void classify(const stimuli::ConvexMesh& mesh,
                                              const WalkResult& hit, const Vec3& tip, const Vec3& d,
                                              double length, LoadedContact& c) {
    const bool edge = hit.feature.kind == ContactFeature::Kind::edge;
    c.contact.type = edge ? ContactType::segment_edge : ContactType::point_polygon;
    c.probe_fraction = hit.probe_fraction;
    std::uint32_t facet = hit.feature.index;
    double slope = 0;
    bool on_left = false;
    if (edge) {
      // Choose the facet of the edge that is more nearly parallel to the probe.
      const stimuli::Edge& e = mesh.edges()[hit.feature.index];
      const double left = glm::dot(mesh.facets()[e.left].normal, d);
      const double right = glm::dot(mesh.facets()[e.right].normal, d);
      on_left = std::abs(left) <= std::abs(right);
      // A selection without a branch, which could not be predicted; ?: would become one.
      facet = e.right ^ ((e.left ^ e.right) & (0u - unsigned{on_left}));
      slope = on_left ? left : right;
    } else {
      slope = glm::dot(mesh.facets()[facet].normal, d);
    }
    if (std::abs(slope) > kSinBlendAngle * length || length == 0) return;
    // Equation (2) of the paper, section 4(b): the contact point moves from one end of the touching
    // portion to the other while the probe turns through the facet's plane, instead of jumping.
    // Depth and normal stay those of the feature.
    const auto [enter, leave] =
        edge && mesh.facets()[facet].side_count == 3
            ? portion_from_edge(mesh, hit, on_left, slope, d)
            : touching_portion(mesh, facet, tip + hit.depth * hit.normal, d);
    if (!(enter <= leave)) return;
    const double turned = small_asin(slope / length) * (0.5 / kBlendAngle);  // -0.5 to 0.5
    c.probe_fraction = std::clamp((0.5 + turned) * enter + (0.5 - turned) * leave, enter, leave);
    c.contact.type = ContactType::segment_face;
  }
};

}  // namespace palpate::rendering::tick
