#pragma once
// The tip alone as what touches: point-based rendering. Mesh frame. Included by what instantiates
// ticks.

#include "rendering/approach.h"
#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/force.h"
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

  /// Type of the contact; it is at the tip.
  static void classify(const stimuli::ConvexMesh&, const WalkResult&, const Vec3&, const Vec3&,
                       double, LoadedContact& c) {
    c.contact.type = ContactType::point_polygon;
  }
};

}  // namespace palpate::rendering::tick
