// Broad phase (scene.h): the parts that the probe can reach soon, by their bounding spheres.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "rendering/scene.h"

namespace palpate::rendering {
namespace {

/// A segment, to which many points are compared.
struct Line {
  Line() = default;
  Line(const Vec3& start, const Vec3& d) : from(start), along(d) {
    const double length2 = glm::dot(d, d);
    per_length2 = length2 > 0 ? 1 / length2 : 0;
  }
  /// m^2, of its nearest point.
  double distance2(const Vec3& p) const {
    const Vec3 to = p - from;
    const double t = std::clamp(per_length2 * glm::dot(to, along), 0.0, 1.0);
    const Vec3 apart = to - t * along;
    return glm::dot(apart, apart);
  }

  Vec3 from, along;        // m
  double per_length2 = 0;  // 1/m^2
};

/// A part in contact stays: pressed through a thin plate, the virtual probe may be far from it.
bool in_contact(const RenderState& state, std::uint32_t part) {
  return state.parts[part].feature.kind != ContactFeature::Kind::none;
}

/// Lists a part, or lets it bound the clearance.
template <class Distance2>
void consider(const Scene& scene, RenderState& state, const Distance2& distance2, double step,
              std::uint32_t index) {
  const ScenePart& part = scene.parts()[index];
  const double gap = std::sqrt(distance2(part.sphere_centre)) - part.sphere_radius;
  if (in_reach(part, gap, step)) {
    state.near_parts.push_back(index);
  } else {
    state.clearance = std::min(state.clearance, gap);
  }
}

/// m, that a part may come nearer before it is near.
double room_before(const ScenePart& part, double gap) {
  return gap - kReachShare * part.sphere_radius;
}

/// Lists the parts that may come near within `room`, m, and how much of it the others have. Spheres
/// of parts that have more than both are passed over.
template <class Distance2>
void search_tree(const Scene& scene, NearbyParts& nearby, const Distance2& distance2, double room) {
  struct Open {
    std::uint32_t node = 0;
    double distance2 = 0;  // m^2, from the middle of its sphere to the probe
  };
  const auto& nodes = scene.part_tree().nodes();
  const auto& order = scene.part_tree().order();
  const auto& spheres = scene.node_spheres();
  nearby.parts.clear();
  nearby.room = std::numeric_limits<double>::infinity();
  std::array<Open, 64> stack{};  // halves at each level: 2^32 parts need 32
  std::size_t count = 0;
  stack[count++] = {0, distance2(spheres[0].centre)};
  while (count > 0) {
    const Open at = stack[--count];
    // No part's sphere is larger than the one that holds it.
    const double far = std::max(room, nearby.room) + (1 + kReachShare) * spheres[at.node].radius;
    if (at.distance2 > far * far) continue;
    const BoundingTree::Node& node = nodes[at.node];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const ScenePart& part = scene.parts()[order[i]];
      const double own =
          room_before(part, std::sqrt(distance2(part.sphere_centre)) - part.sphere_radius);
      if (own <= room)
        nearby.parts.push_back(order[i]);
      else
        nearby.room = std::min(nearby.room, own);
    }
    if (node.count > 0) continue;
    Open near{at.node + 1, distance2(spheres[at.node + 1].centre)};
    Open other{node.first, distance2(spheres[node.first].centre)};
    if (other.distance2 < near.distance2) std::swap(near, other);
    stack[count++] = other;
    stack[count++] = near;
  }
}

/// \param distance2  from a point to the probe, m^2
/// \param step       m, how far the probe may have moved past a part
/// \param moved      m, how far any point of the probe is from where the nearby parts were listed
/// \return whether these were listed anew
template <class Distance2>
bool list_near_parts(const Scene& scene, RenderState& state, const Distance2& distance2,
                     double step, double moved) {
  state.clearance = std::numeric_limits<double>::infinity();
  if (scene.part_tree().nodes().empty()) {
    state.near_parts.clear();
    for (std::uint32_t i = 0; i < scene.parts().size(); ++i) {
      if (in_contact(state, i))
        state.near_parts.push_back(i);
      else
        consider(scene, state, distance2, step, i);
    }
    return false;
  }
  // A leap lists too many, and so may a crowd: for no longer than it takes to list fewer.
  const double mean = scene.mean_radius(), soon = kReachShare * mean;
  const bool leaps = step > soon;
  double others = state.nearby.room - moved;  // m, at least, of every part that is not nearby
  const bool anew = !(others > step);
  if (anew) {
    search_tree(scene, state.nearby, distance2, step + mean);
    others = state.nearby.room;
    if (state.nearby.parts.size() > Scene::kFewParts)
      state.nearby.room = std::min(others, leaps ? soon : 2 * mean);
  }
  std::erase_if(state.near_parts, [&](std::uint32_t i) { return !in_contact(state, i); });
  for (const std::uint32_t i : state.nearby.parts) {
    if (!in_contact(state, i)) consider(scene, state, distance2, step, i);
  }
  state.clearance = std::min(state.clearance, others);
  if (leaps || state.clearance == std::numeric_limits<double>::infinity())
    state.clearance = std::min(state.clearance, soon);
  std::sort(state.near_parts.begin(), state.near_parts.end());
  return anew;
}

}  // namespace

void update_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe,
                       const ToolPose& tool, bool sides) {
  if (state.clearance == std::numeric_limits<double>::infinity()) return;
  UnionMemory& memory = state.unions;
  const Tool* const carried = sides ? scene.tool() : nullptr;
  // The tool moves no farther than its tip and what its size makes of the turn of its frame.
  const auto moved = [&](const ToolPose& a, const ToolPose& b) {
    double out = glm::length(a.tip - b.tip);
    if (carried == nullptr) return std::max(out, glm::length(a.tip + a.d - b.tip - b.d));
    double turned2 = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 apart = a.frame[k] - b.frame[k];
      turned2 += glm::dot(apart, apart);
    }
    return out + scene.tool_reach() * std::sqrt(turned2);
  };
  const double step = state.has_last ? moved(tool, memory.last) : 0;
  const double slack = memory.reach + step;
  if (state.clearance > 0 && moved(tool, memory.near_pose) + slack < state.clearance) return;
  state.near_parts_pose = probe;
  memory.near_pose = tool;
  const PlacedTool& placed = memory.now;
  std::array<Line, Tool::kMostSegments> lines;
  for (std::size_t j = 0; j < placed.count; ++j)
    lines[j] = {tool.tip + placed.segments[j].from, placed.segments[j].along};
  const auto distance2 = [&](const Vec3& p) {
    double least = HUGE_VAL;
    for (std::size_t j = 0; j < placed.count; ++j) least = std::min(least, lines[j].distance2(p));
    return least;
  };
  if (list_near_parts(scene, state, distance2, step + slack, moved(tool, memory.nearby_pose)))
    memory.nearby_pose = tool;
}

void rebuild_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe) {
  // How far the probe moved in this tick: what it may have passed counts as near.
  const double step = state.has_last ? std::max(glm::length(probe.tip - state.last.tip),
                                                glm::length(probe.tail - state.last.tail))
                                     : 0;
  state.near_parts_pose = probe;
  const Line line(probe.tip, probe.tail - probe.tip);
  const LineProbe& listed = state.nearby.pose;
  const double moved =
      std::max(glm::length(probe.tip - listed.tip), glm::length(probe.tail - listed.tail));
  const auto distance2 = [&](const Vec3& p) { return line.distance2(p); };
  if (list_near_parts(scene, state, distance2, step, moved)) state.nearby.pose = probe;
}

}  // namespace palpate::rendering
