#pragma once
// The tip alone as what touches. Included by what instantiates ticks.

#include "rendering/tick.h"

namespace palpate::rendering::tick {

/// The probe shrunk to its tip.
struct PointProbe {
  static constexpr bool kSegment = false;

  static Approach approach(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                           const LineProbe& before, const LineProbe& after) {
    return approach_point(mesh, start, before, after);
  }

  static FirstContact first_contact(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                    const LineProbe& before, const LineProbe& after,
                                    double tolerance) {
    return first_contact_point(mesh, trees, before.tip, after.tip, tolerance);
  }

  static void describe(const stimuli::ConvexMesh&, const WalkResult&, const Vec3&, const Vec3&,
                       double, LoadedContact& c) {
    c.contact.type = ContactType::point_polygon;
  }
};

}  // namespace palpate::rendering::tick
