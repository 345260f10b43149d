#include "rendering/near_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/approach.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

/// m, of a segment, the tool's tip where it is, above a plane.
double height_above(const Vec3& normal, double offset, const Vec3& tip,
                    const PlacedSegment& segment) {
  return glm::dot(normal, tip + segment.from) - offset +
         std::min(0.0, glm::dot(normal, segment.along));
}

/// From a point to the nearest of a segment that starts at `to_start` from it.
Vec3 to_nearest(const Vec3& to_start, const Vec3& along, double per_length2) {
  return to_start - std::clamp(per_length2 * glm::dot(to_start, along), -1.0, 0.0) * along;
}

[[gnu::always_inline]] inline void prefetch(const stimuli::ConvexMesh& mesh,
                                            ContactFeature feature) {
  if (feature.kind == Kind::edge)
    __builtin_prefetch(&mesh.edges()[feature.index]);
  else
    __builtin_prefetch(&mesh.facets()[feature.index]);
}

double inverse_length2(const Vec3& along) {
  const double length2 = glm::dot(along, along);
  return length2 > 0 ? 1 / length2 : 0;
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

void NearPairs::collect(const ToolPose& from, const PlacedTool& placed_from, double motion,
                        double reach) {
  all_.near.clear();
  const PlacedTool& now = all_.now;
  std::array<double, Tool::kMostSegments> per_length2;
  for (std::uint32_t j = 0; j < now.count; ++j)
    per_length2[j] = inverse_length2(now.segments[j].along);
  const auto segments = static_cast<std::uint32_t>(tick_.scene.segments());
  visit_near_parts([&](std::uint32_t index) {
    const ScenePart& part = tick_.scene.parts()[index];
    if (part.breaking != ScenePart::kHolds && all_.breaking[part.breaking].strength == 0) return;
    const Vec3 to_tip = tick_.tool.tip - part.sphere_centre;
    const double margin = 2 * part.margin + part.tolerance;
    const double far = part.sphere_radius + std::max(motion, reach) + margin;
    const std::uint32_t first = group_.first_pair + (index - group_.first_part) * segments;
    for (std::uint32_t j = 0; j < now.count; ++j) {
      const PairState& state = all_.pairs[first + j];
      const PlacedSegment& segment = now.segments[j];
      Vec3 normal;
      double offset = 0;
      bool was_apart = false;
      if (!state.carries) {
        const Vec3 apart = to_nearest(to_tip + segment.from, segment.along, per_length2[j]);
        if (glm::dot(apart, apart) > far * far) continue;
        if (state.plane.valid) {
          normal = part.world_vector(state.plane.normal);
          offset = state.plane.offset + glm::dot(normal, part.position) + margin + part.tolerance;
          was_apart = height_above(normal, offset, from.tip, placed_from.segments[j]) > 0;
          if (was_apart && height_above(normal, offset, tick_.tool.tip, segment) > reach) continue;
        }
      }
      NearPair& near = all_.near.emplace_back();
      near.part = index;
      near.pair = first + j;
      near.segment = j;
      near.normal = normal;
      near.offset = offset;
      near.has_plane = !state.carries && state.plane.valid;
      near.was_apart = was_apart;
      near.came_with = state.feature;
      if (part.trees->facet_map() != nullptr) prefetch(*part.mesh, state.feature);
    }
  });
}

bool NearPairs::part_by_sphere(NearPair& near, const PosedSegment& from, const PosedSegment& to) {
  const ScenePart& part = part_of(near);
  const Vec3 apart = to_nearest(to.start - part.sphere_centre, to.along, inverse_length2(to.along));
  const double margin = 2 * (part.margin + part.tolerance);
  const double radius = part.sphere_radius + margin;
  const double distance2 = glm::dot(apart, apart);
  if (!(distance2 > radius * radius)) return false;
  const Vec3 normal = apart / std::sqrt(distance2);
  const double offset = glm::dot(normal, part.sphere_centre) + radius;
  const auto above = [&](const PosedSegment& segment) {
    return glm::dot(normal, segment.start) + std::min(0.0, glm::dot(normal, segment.along)) >
           offset;
  };
  if (!above(from) || !above(to)) return false;
  near.normal = normal;
  near.offset = offset;
  near.height = height_above(normal, offset, tick_.tool.tip, oriented_->segments[near.segment]);
  near.has_plane = true;
  state_of(near).plane = {part.local_vector(normal),
                          offset - margin - glm::dot(normal, part.position), true};
  return true;
}

void NearPairs::orient(const PlacedTool& oriented) {
  oriented_ = &oriented;
  for (NearPair& near : all_.near) {
    const ScenePart& part = part_of(near);
    const PlacedSegment& segment = oriented.segments[near.segment];
    near.true_tip = part.local_point(tick_.tool.tip + segment.from);
    near.true_d = part.local_vector(segment.along);
    near.tip = part.inside + part.shrink * (near.true_tip - part.inside);
    near.d = part.shrink * near.true_d;
    if (part.trees->facet_map() != nullptr && near.came_with.kind != Kind::none)
      prefetch_neighbours(*part.mesh, near.came_with);
    if (near.has_plane)
      near.height = height_above(near.normal, near.offset, tick_.tool.tip, segment);
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
  collect(tick_.tool, all_.now, 0, 0);
  orient(all_.now);
  for (NearPair& near : all_.near) {
    const WalkResult at = locate(mesh_of(near), state_of(near).feature, near.true_tip, near.true_d);
    state_of(near).feature = at.feature.kind != Kind::none ? at.feature : at.separating_feature;
    if (at.feature.kind != Kind::none && at.depth > part_of(near).tolerance) return true;
  }
  return false;
}

}  // namespace palpate::rendering
