#include <algorithm>
#include <glm/geometric.hpp>

#include "rendering/ideal_tool.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

constexpr int kPushRounds = 12;          // to get out of what a turn brought the tool into
constexpr double kLeastTurn = 1.0 / 16;  // of a turn that fails; then it waits for the next tick
constexpr double kFarPush = 8;           // times the turn's own motion; farther is no way out

}  // namespace

/// Puts the plane of a pair in use, in place of the one it had. False where there is no room.
bool IdealTool::put_plane(std::uint32_t index, ContactFeature feature) {
  const Plane plane = plane_of(index, feature);
  pairs_.state_of(pairs_[index]).feature = plane.feature;
  for (Plane& old : planes_.all()) {
    if (old.near != index) continue;
    old = plane;
    return true;
  }
  if (planes_.full()) return false;
  pairs_[index].carries = true;
  planes_.add(plane);
  return true;
}

/// Turns the ideal tool as the virtual one has turned, about where it touches, as far as the parts
/// let it.
/// \param most  of the turn \return what it took of it, 0 to 1
double IdealTool::turn(const ToolPose& from, double most) {
  PlacedTool& before = all_.before;
  pairs_.place(from, before);
  const PlacedTool& after = pairs_.now();
  const Vec3 shift = turned(memory_.grasp, from) - turned(memory_.grasp, tick_.tool);
  double motion = 0;
  for (std::size_t j = 0; j < before.count; ++j) {
    const Vec3 start = after.segments[j].from - before.segments[j].from + shift;
    motion = std::max({motion, glm::length(start),
                       glm::length(start + after.segments[j].along - before.segments[j].along)});
  }
  const double far = kFarPush * motion + 4 * group_.skin;
  const double reach =
      glm::length(from.tip - tick_.tool.tip) + glm::length(shift) + 2 * motion + far;
  pairs_.collect(from, before, reach, reach);
  if (motion == 0) {
    pose_ = tick_.tool;
    at_ = from.tip - tick_.tool.tip;
    pairs_.orient(before);
    return 0;
  }
  for (double fraction = most; fraction >= kLeastTurn; fraction *= 0.5) {
    ToolPose to = fraction == 1 ? tick_.tool : between(from, tick_.tool, fraction);
    to.tip = from.tip + turned(memory_.grasp, from) - turned(memory_.grasp, to);
    if (fraction < 1) pairs_.place(to, all_.turned);
    pairs_.orient(fraction == 1 ? after : all_.turned);
    if (settle(from, before, to, far)) {
      pose_ = to;
      return fraction;
    }
  }
  pose_ = from;
  at_ = from.tip - tick_.tool.tip;
  planes_.clear();
  pairs_.orient(before);
  return 0;
}

/// Whether a turned tool, oriented, gets out of all parts near where it is; then it is there.
bool IdealTool::settle(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
                       double most_push) {
  planes_.clear();
  for (NearPair& near : pairs_.all()) near.carries = false;
  at_ = to.tip - tick_.tool.tip;
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    NearPair& near = pairs_[i];
    PairState& state = pairs_.state_of(near);
    ContactFeature start = state.feature;
    const Vec3 tip = pairs_.local(near, at_);
    if (!state.carries) {
      if (near.was_apart && apart(near, at_, at_)) continue;
      if (pairs_.part_by_sphere(near, NearPairs::posed(near, from.tip, placed_from),
                                pairs_.posed(near, at_)))
        continue;
      near.was_cast = true;
      const Entry entry =
          pairs_.sweep(near, pairs_.shrunk(near, from.tip, placed_from.segments[near.segment]),
                       {tip, tip + near.d});
      if (!entry.entered) continue;
      start = entry.feature;
    }
    const WalkResult at = locate(pairs_.mesh_of(near), start, tip, near.d);
    if (at.feature.kind != Kind::none && !put_plane(i, at.feature)) return false;
  }
  return planes_.empty() || push_out(at_, most_push);
}

/// Moves the tool out of the parts whose planes are in use, and of those that it comes into then.
bool IdealTool::push_out(const Vec3& from, double most_push) {
  for (int round = 0; round < kPushRounds; ++round) {
    if (!planes_.nearest(from, group_.skin, group_.skin / 8, at_)) return false;
    const Vec3 moved = at_ - from;
    if (!(glm::dot(moved, moved) <= most_push * most_push)) return false;
    bool out = true;
    for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
      NearPair& near = pairs_[i];
      ContactFeature inside;
      if (near.carries) {
        inside = locate(pairs_.mesh_of(near), pairs_.state_of(near).feature,
                        pairs_.local(near, at_), near.d)
                     .feature;
      } else {
        if (apart(near, from, at_) ||
            pairs_.part_by_sphere(near, pairs_.posed(near, from), pairs_.posed(near, at_)))
          continue;
        near.was_cast = true;
        const PairCast hit =
            cast(pairs_.mesh_of(near), pairs_.state_of(near).feature, pairs_.local(near, from),
                 near.d, pairs_.part_of(near).shrink * pairs_.part_of(near).local_vector(moved));
        pairs_.state_of(near).feature = hit.feature;
        if (hit.hit) inside = hit.feature;
      }
      if (inside.kind == Kind::none) continue;
      out = false;
      if (!put_plane(i, inside)) return false;
    }
    if (out) return true;
  }
  return false;
}

}  // namespace palpate::rendering
