#include <algorithm>
#include <glm/geometric.hpp>

#include "rendering/surface_query.h"
#include "rendering/surface_tool.h"

namespace palpate::rendering {
namespace {

constexpr int kPushRounds = 12;          // to get out of what a turn brought the tool into
constexpr double kLeastTurn = 1.0 / 16;  // of a turn that fails; then it waits for the next tick
constexpr double kFarPush = 8;           // times the turn's own motion; farther is no way out
constexpr double kLonger = 1e-11;        // of the size, by which edges are longer for a sweep

/// m, of any end of a segment.
double most_moved(const PosedTool& from, const PosedTool& to, const Vec3& shift) {
  double most2 = 0;
  for (std::size_t j = 0; j < to.count; ++j) {
    const Vec3 start = to.segments[j].start + shift - from.segments[j].start;
    const Vec3 end = start + to.segments[j].along - from.segments[j].along;
    most2 = std::max({most2, glm::dot(start, start), glm::dot(end, end)});
  }
  return std::sqrt(most2);
}

/// rad, of any segment.
double most_turned(const PosedTool& from, const PosedTool& to) {
  double most2 = 0;
  for (std::size_t j = 0; j < to.count; ++j) {
    const Vec3 turn = to.segments[j].along - from.segments[j].along;
    const double length2 = glm::dot(to.segments[j].along, to.segments[j].along);
    if (length2 > 0) most2 = std::max(most2, glm::dot(turn, turn) / length2);
  }
  return std::sqrt(most2);
}

}  // namespace

/// The first patch that a tool meets whose segments' ends move linearly.
PatchHit SurfaceTool::sweep(const PosedTool& from, const PosedTool& to, const Vec3& shift) const {
  PatchHit first;
  const double slack = kLonger * surface_.size();
  const auto look = [&](std::uint32_t triangle, std::size_t j, std::uint8_t what) {
    const PosedTool::Segment end{to.segments[j].start + shift, to.segments[j].along};
    sweep_triangle(surface_, triangle, static_cast<std::uint8_t>(j), what, from.segments[j], end,
                   tolerance_, slack, first);
  };
  if (own_.has_list && moved_from_list(from, Vec3(0)) < own_.room &&
      moved_from_list(to, shift) < own_.room) {
    for (const NearTriangle& near : own_.near) look(near.triangle, near.segment, near.what);
    return first;
  }
  for (std::size_t j = 0; j < to.count; ++j) {
    const PosedTool::Segment& a = from.segments[j];
    const PosedTool::Segment b{to.segments[j].start + shift, to.segments[j].along};
    const Vec3 start = 0.5 * (a.start + b.start), along = 0.5 * (a.along + b.along);
    const double reach =
        0.5 * std::max(glm::length(b.start - a.start), glm::length(b.end(true) - a.end(true))) +
        2 * skin_;
    surface_.near_segment(start, along, reach, [&](std::uint32_t triangle) {
      look(triangle, j, surface_pair::kAll);
      return true;
    });
  }
  return first;
}

/// Turns the ideal tool as the virtual one has turned, about where it touches, as far as the
/// surface lets it.
/// \param most  of the turn \return what it took of it, 0 to 1
double SurfaceTool::turn(const ToolPose& from, double most) {
  const PosedTool before = pose(from);
  const PosedTool whole = pose(target_);
  const Vec3 shift =
      placed_.local_vector(turned(memory_.grasp, from) - turned(memory_.grasp, target_));
  const Vec3 apart = placed_.local_vector(from.tip - target_.tip);
  planes_.clear();
  // About the grasp, from where the tool was to the virtual orientation there.
  const double motion = most_moved(before, whole, apart + shift);
  PosedTool near_whole = whole;
  for (std::size_t j = 0; j < whole.count; ++j) near_whole.segments[j].start += apart + shift;
  keep_list(before, near_whole);
  if (motion == 0) {
    pose_ = target_;
    turned_ = whole;
    at_ = apart;
    return 0;
  }
  const double far = kFarPush * motion + 4 * skin_;
  for (double fraction = most; fraction >= kLeastTurn; fraction *= 0.5) {
    ToolPose to = target_;
    if (fraction < 1) to = between(from, target_, fraction);
    to.tip = target_.tip;
    pose_ = to;
    turned_ = fraction == 1 ? whole : pose(to);
    at_ = placed_.local_vector(from.tip + turned(memory_.grasp, from) - turned(memory_.grasp, to) -
                               target_.tip);
    if (settle(before, far)) return fraction;
  }
  pose_ = from;
  pose_.tip = target_.tip;
  turned_ = before;
  for (std::size_t j = 0; j < turned_.count; ++j) turned_.segments[j].start -= apart;
  at_ = apart;
  planes_.clear();
  return 0;
}

/// Whether a tool that turns to turned_, moved by about at_, gets there without meeting a patch;
/// then it is there.
bool SurfaceTool::settle(const PosedTool& from, double most_push) {
  const Vec3 wanted = at_;
  double dip = skin_ + 0.125 * most_moved(from, turned_, wanted) * most_turned(from, turned_);
  planes_.clear();
  for (std::size_t i = 0; i < own_.carrying_count; ++i) {
    const SurfacePatch patch = patch_after_turn(surface_, own_.carrying[i], turned_);
    if (!holds(patch) && !planes_.full()) planes_.add(plane_at(patch));
  }
  for (int round = 0; round < kPushRounds; ++round) {
    if (!planes_.empty()) {
      if (!planes_.nearest(wanted, skin_, skin_ / 8, at_)) return false;
      const Vec3 moved = at_ - wanted;
      if (!(glm::dot(moved, moved) <= most_push * most_push)) return false;
    }
    const PatchHit hit = sweep(from, turned_, at_);
    if (!hit.hit()) return true;
    const SurfacePatch patch = patch_after_turn(surface_, hit.patch, turned_);
    bool held = false;
    for (SurfacePlane& plane : planes_.all()) {
      if (!(plane.patch == patch)) continue;
      // On its way it dips under an edge that it is above at either end.
      plane.depth += dip;
      held = true;
    }
    dip *= 2;
    if (held) continue;
    if (planes_.full()) return false;
    planes_.add(plane_at(patch));
  }
  return false;
}

}  // namespace palpate::rendering
