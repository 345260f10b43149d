#include "rendering/near_pairs.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/approach.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

/// m, of a segment above the plane of a pair.
double height_above(const NearPair& near, const Vec3& tip, const PlacedSegment& segment) {
  return glm::dot(near.normal, tip + segment.from) - near.offset +
         std::min(0.0, glm::dot(near.normal, segment.along));
}

}  // namespace

template <class Visit>
void NearPairs::visit_near_parts(const Visit& visit) const {
  const auto& near = tick_.state.near_parts;
  const std::uint32_t end = group_.first_part + group_.part_count;
  for (auto i = std::lower_bound(near.begin(), near.end(), group_.first_part);
       i != near.end() && *i < end; ++i) {
    visit(*i);
  }
}

LineProbe NearPairs::shrunk(const NearPair& near, const Vec3& tip,
                            const PlacedSegment& segment) const {
  const ScenePart& part = part_of(near);
  const Vec3 from = part.local_point(tip + segment.from);
  const Vec3 start = part.inside + part.shrink * (from - part.inside);
  return {start, start + part.shrink * part.local_vector(segment.along)};
}

/// Takes up the plane of an earlier tick.
void NearPairs::take_up_plane(NearPair& near) {
  const SeparatingPlane& plane = state_of(near).plane;
  near.has_plane = plane.valid;
  if (!plane.valid) return;
  const ScenePart& part = part_of(near);
  near.normal = part.world_vector(plane.normal);
  near.offset =
      plane.offset + glm::dot(near.normal, part.position) + 2 * (part.margin + part.tolerance);
}

void NearPairs::collect(const ToolPose& from, const PlacedTool& placed_from, double motion,
                        double reach) {
  all_.near.clear();
  const PlacedTool& now = now_;
  visit_near_parts([&](std::uint32_t index) {
    const ScenePart& part = tick_.scene.parts()[index];
    if (part.breaking != ScenePart::kHolds && all_.breaking[part.breaking].strength == 0) return;
    for (std::uint32_t j = 0; j < now.count; ++j) {
      NearPair near;
      near.part = index;
      near.segment = j;
      near.pair = group_.first_pair +
                  (index - group_.first_part) * static_cast<std::uint32_t>(tick_.scene.segments()) +
                  j;
      PairState& state = state_of(near);
      if (!state.carries) {
        const Vec3 to_start = part.sphere_centre - (tick_.tool.tip + now.segments[j].from);
        const Vec3& along = now.segments[j].along;
        const double length2 = glm::dot(along, along);
        const double fraction =
            length2 > 0 ? std::clamp(glm::dot(to_start, along) / length2, 0.0, 1.0) : 0;
        const Vec3 apart = to_start - fraction * along;
        const double far =
            part.sphere_radius + std::max(motion, reach) + 2 * part.margin + part.tolerance;
        if (glm::dot(apart, apart) > far * far) continue;
        take_up_plane(near);
        near.was_apart =
            near.has_plane && height_above(near, from.tip, placed_from.segments[j]) > 0;
        if (near.was_apart && height_above(near, tick_.tool.tip, now.segments[j]) > reach) continue;
      }
      all_.near.push_back(near);
    }
  });
}

void NearPairs::orient(const PlacedTool& oriented) {
  oriented_ = oriented;
  for (NearPair& near : all_.near) {
    const ScenePart& part = part_of(near);
    const PlacedSegment& segment = oriented.segments[near.segment];
    near.true_tip = part.local_point(tick_.tool.tip + segment.from);
    near.true_d = part.local_vector(segment.along);
    near.tip = part.inside + part.shrink * (near.true_tip - part.inside);
    near.d = part.shrink * near.true_d;
    if (near.has_plane) near.height = height_above(near, tick_.tool.tip, segment);
  }
}

Entry NearPairs::sweep(NearPair& near, const LineProbe& before, const LineProbe& after) {
  PairState& state = state_of(near);
  const CastMesh mesh = mesh_of(near);
  const Vec3 d = before.tail - before.tip;
  const WalkResult start = locate(mesh, state.feature, before.tip, d);
  if (start.feature.kind != Kind::none) return {true, 0, start.feature};
  const bool point = glm::dot(d, d) == 0 && before.tail - before.tip == after.tail - after.tip;
  Approach approach;
  if (start.separating_feature.kind != Kind::none)
    approach = point ? approach_point(mesh.mesh, start.separating_feature, before, after)
                     : approach_segment(mesh.mesh, start.separating_feature, before, after);
  if (approach.end == Approach::End::separated) {
    state.feature = approach.feature;
    state.plane = approach.plane;
    return {};
  }
  if (approach.end == Approach::End::entered) return {true, approach.time, approach.feature};
  const double tolerance = part_of(near).tolerance;
  const FirstContact first =
      point ? first_contact_point(mesh.mesh, mesh.trees, before.tip, after.tip, tolerance)
            : first_contact_segment(mesh.mesh, mesh.trees, before, after, tolerance);
  if (first.feature.kind != Kind::none) return {true, first.time, first.feature};
  const WalkResult end = locate(mesh, start.separating_feature, after.tip, after.tail - after.tip);
  if (end.feature.kind != Kind::none) return {true, 1, end.feature};
  state.feature = end.separating_feature;
  return {};
}

bool NearPairs::virtual_inside() {
  collect(tick_.tool, now_, 0, 0);
  orient(now_);
  for (NearPair& near : all_.near) {
    const WalkResult at = locate(mesh_of(near), state_of(near).feature, near.true_tip, near.true_d);
    state_of(near).feature = at.feature.kind != Kind::none ? at.feature : at.separating_feature;
    if (at.feature.kind != Kind::none && at.depth > part_of(near).tolerance) return true;
  }
  return false;
}

}  // namespace palpate::rendering
