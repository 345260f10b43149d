#pragma once
// Contact with one convex part that the probe did not touch at the last tick: separating plane,
// approach, first contact. Mesh frame and SI units unless said otherwise. Included by tick.h alone.
//
// Probe is PointProbe or SegmentProbe.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/probe.h"
#include "rendering/scene.h"
#include "rendering/separation.h"

namespace palpate::rendering {

/// How a tick of motion near an object ended.
struct Approach {
  enum class End : std::uint8_t { separated, entered, undecided };
  End end = End::undecided;
  ContactFeature feature;  ///< separated: its plane separates at the end; entered: through it
  SeparatingPlane plane;   ///< separated: valid, at the end of the motion
  double time = 0;         ///< entered: time of impact, as a fraction of the tick
};

/// Tracks a probe outside an object, near it, from feature to neighbouring feature: continuous
/// collision detection without a search. Both ends move linearly from `before` to `after`. The
/// facet of M whose plane separates it is kept until the probe crosses that plane; there it either
/// enters through the facet, or it is past a side and the facet of M beyond that side separates
/// from then on. The times of crossing only grow, and the probe is proven to be outside up to each.
/// So the entry found is the first one, at any speed. Undecided (rounding, or a long path around
/// the object): use first_contact.
/// \param start  a feature whose plane separates the probe at `before`
Approach approach_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                          const LineProbe& before, const LineProbe& after);

/// The same for the tip alone.
Approach approach_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                        const LineProbe& before, const LineProbe& after);

}  // namespace palpate::rendering

namespace palpate::rendering::tick {

/// A feature near a probe outside the object, from which to track it: that of an earlier tick, or
/// one under the point of the probe that is nearest to the mesh's centre. Kind none: no feature is
/// known.
template <class Probe>
ContactFeature nearby_feature(const ScenePart& part, ContactFeature known, const LineProbe& probe) {
  using Kind = ContactFeature::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const FacetMap* const map = part.trees->facet_map();
  if (map == nullptr) return known;
  const Vec3 d = probe.tail - probe.tip;
  const ContactFeature under(Kind::facet, false, map->facet_under(probe.tip, d));
  if (known.kind == Kind::none) return under;
  return Probe::same_feature(mesh, known, probe.tip, d).depth <=
                 Probe::same_feature(mesh, under, probe.tip, d).depth
             ? known
             : under;
}

/// The probe has left the part: from now on the feature by which it left separates them.
inline void record_separation(PartState& state, const WalkResult& left, const LineProbe& probe) {
  const double lower =
      std::min(glm::dot(left.normal, probe.tip), glm::dot(left.normal, probe.tail));
  state.plane = {left.normal, lower + left.depth, true};
  state.nearby = left.separating_feature;
}

/// Scans all features after a walk that did not converge, if no separating plane was found. False
/// if the probe at most touches the surface. Otherwise `hit` becomes the feature that holds it; of
/// several, the nearest to where the walk ended. Rare.
template <class Probe>
[[gnu::cold, gnu::noinline]] bool search_all_features(const ScenePart& part, const Vec3& tip,
                                                      const Vec3& d, WalkResult& hit) {
  const WalkResult nearest = Probe::nearest_feature(*part.mesh, tip, d);
  if (nearest.feature.kind == ContactFeature::Kind::none || nearest.depth <= part.tolerance) {
    return false;
  }
  const WalkResult holding = Probe::holding_feature(*part.mesh, tip, d, hit.depth * hit.normal);
  hit = holding.feature.kind != ContactFeature::Kind::none ? holding : nearest;
  return true;
}

/// Searches for a separating plane between the part and the probe, without history; sets
/// state.plane.valid.
inline void search_separating_plane(const ScenePart& part, PartState& state,
                                    const LineProbe& probe) {
  const stimuli::ConvexMesh& mesh = *part.mesh;
  find_separating_plane(mesh, probe.tip, probe.tail, part.tolerance, state.plane, state.support,
                        part.trees->support_map());
  const std::uint32_t edge = mesh.fan_edges()[mesh.fan_first()[state.support]];
  state.nearby = {ContactFeature::Kind::facet, false, mesh.edges()[edge].left};
}

/// Over a large mesh, whose facets are not in the processor's caches: follows the probe to the
/// facet of M under it, treats its plane as no longer separating some ticks before the crossing, so
/// that contact detection starts then, and prefetches the memory that the next tick will need.
/// \param from  the probe at the last tick
template <class Probe>
[[gnu::noinline]] void watch_surface(const ScenePart& part, PartState& state, const LineProbe& from,
                                     const LineProbe& probe) {
  constexpr double kTicks = 4;
  constexpr double kOfSize = 1.0 / 256;  // at least; a hand may speed up
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const ContactFeature near = nearby_feature<Probe>(part, state.nearby, probe);
  const WalkResult under = Probe::farthest_plane(mesh, near, probe.tip, probe.tail - probe.tip);
  if (under.separating_feature.kind != ContactFeature::Kind::none)
    record_separation(state, under, probe);
  const Vec3 tip = probe.tip - from.tip, tail = probe.tail - from.tail;
  const double motion = std::sqrt(std::max(glm::dot(tip, tip), glm::dot(tail, tail)));
  state.plane.offset += std::max(kTicks * motion, kOfSize * mesh.size());
  prefetch_neighbours(mesh, state.nearby);
}

/// Prepares for contact after a tick that ended with a separating plane.
template <class Probe>
void expect_contact(const ScenePart& part, PartState& state, const LineProbe& from,
                    const LineProbe& probe) {
  if (part.trees->facet_map() != nullptr && state.plane.valid)
    watch_surface<Probe>(part, state, from, probe);
}

/// Contact with a part that was not in contact at the last tick; kind `none` without contact.
/// \param before  the probe at the last tick, world frame; null at the first tick of all
template <class Probe>
WalkResult detect_contact(const ScenePart& part, PartState& state, const LineProbe* before,
                          const LineProbe& probe) {
  using Kind = ContactFeature::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const Vec3 d = probe.tail - probe.tip;
  LineProbe from = probe;
  FirstContact first;
  bool decided = false;
  if (before && !state.started_inside) {
    from = Probe::to_local(part, *before);
    const ContactFeature near = nearby_feature<Probe>(part, state.nearby, from);
    if (near.kind != Kind::none) {
      const WalkResult was = Probe::walk(mesh, near, from.tip, from.tail - from.tip);
      if (was.feature.kind == Kind::none) {
        const Approach approach = Probe::approach(mesh, was.separating_feature, from, probe);
        if (approach.end == Approach::End::separated) {
          state.plane = approach.plane;
          state.nearby = approach.feature;
          expect_contact<Probe>(part, state, from, probe);
          return {};
        }
        decided = approach.end == Approach::End::entered;
        if (decided) first = {approach.feature, approach.time};
      }
    }
  }
  if (!decided) {
    search_separating_plane(part, state, probe);
    if (state.started_inside || !before) {
      state.started_inside =
          !state.plane.valid && (state.started_inside ||
                                 Probe::nearest_feature(mesh, probe.tip, d).depth > part.tolerance);
      expect_contact<Probe>(part, state, from, probe);
      return {};
    }
    if (state.plane.separates(from.tip, from.tail)) {  // and all poses between
      expect_contact<Probe>(part, state, from, probe);
      return {};
    }
    first = Probe::first_contact(mesh, *part.trees, from, probe, part.tolerance);
  }
  WalkResult hit;
  if (first.feature.kind != Kind::none) hit = Probe::walk(mesh, first.feature, probe.tip, d);
  if (hit.not_converged) [[unlikely]] {
    if (decided) search_separating_plane(part, state, probe);
    if (state.plane.valid || !search_all_features<Probe>(part, probe.tip, d, hit)) return {};
  }
  if (hit.feature.kind == Kind::none) {
    if (decided) {  // in and out again
      record_separation(state, hit, probe);
      return {};
    }
    if (state.plane.valid) return {};
    // No plane and no crossing: rounding hid the entry, so the least penetration depth decides.
    // Rare.
    hit = Probe::nearest_feature(mesh, probe.tip, d);
    if (hit.feature.kind == Kind::none || hit.depth <= part.tolerance) return {};
  }
  state.feature = hit.feature;
  state.plane.valid = false;
  prefetch_neighbours(mesh, state.feature);
  return hit;
}

}  // namespace palpate::rendering::tick
