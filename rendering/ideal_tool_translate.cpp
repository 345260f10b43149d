#include <algorithm>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/ideal_tool.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

constexpr int kRounds = 96;          // of casts in one tick; then the ideal tool stays where it is
constexpr double kSlidOff = 4;       // skins; a contact farther off its facet has left it,
constexpr double kOnFacet = 1e-11;   // or farther than this of the size, where the skin is thin
constexpr double kAtRest = 2e-12;    // of the size: the same without the skin
constexpr double kExact = 1e-5;      // of the skin; what is nearer than this is rounding
constexpr double kRounding = 0.125;  // of the skin; so much less of it is a skin
constexpr double kLessSkin = 0.25;   // of the skin, in a gap where two do not fit, and so on
constexpr double kInTheWay = 0.25;   // of rounding; what a tool at rest is deeper in holds it
constexpr double kSamePlace = 8;     // skins; within it a contact that comes back never left

}  // namespace

/// Takes up the planes that held the tool at the last tick, where it is still beyond them.
void IdealTool::resume_planes() {
  planes_.remove_if([](const Plane& plane) { return plane.multiplier <= 0; });
  for (NearPair& near : pairs_.all()) near.carries = false;
  for (const Plane& plane : planes_.all()) pairs_[plane.near].carries = true;
  for (std::uint32_t i = 0; i < pairs_.size() && !planes_.full(); ++i) {
    NearPair& near = pairs_[i];
    if (!pairs_.state_of(near).carries || near.carries) continue;
    const Plane plane = plane_of(i, pairs_.state_of(near).feature);
    if (!(glm::dot(plane.normal, at_) - plane.depth > 0)) continue;
    near.carries = true;
    planes_.add(plane);
  }
}

/// The first part on the straight way to `goal`.
bool IdealTool::next_hit(const Vec3& goal, std::uint32_t& hit, PairCast& first) {
  first.time = 2;
  const Vec3 way = goal - at_;
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    NearPair& near = pairs_[i];
    if (near.carries) continue;  // convex, and behind a plane that the way stays beyond
    if (apart(near, at_, goal) ||
        pairs_.part_by_sphere(near, pairs_.posed(near, at_), pairs_.posed(near, goal)))
      continue;
    near.was_cast = true;
    const PairCast found =
        cast(pairs_.mesh_of(near), pairs_.state_of(near).feature, pairs_.local(near, at_), near.d,
             pairs_.part_of(near).shrink * pairs_.part_of(near).local_vector(way));
    pairs_.state_of(near).feature = found.feature;
    if (!found.hit || !(found.time < first.time)) continue;
    first = found;
    hit = i;
  }
  return first.time <= 1;
}

/// Whether the tool, on its way and a skin away, is past the facet.
bool IdealTool::slid_off(const Plane& plane) const {
  const NearPair& near = pairs_[plane.near];
  const stimuli::ConvexMesh& mesh = *pairs_.part_of(near).mesh;
  const double slack = kSlidOff * group_.skin + kOnFacet * (mesh.size() + glm::length(near.d));
  return distance_off(mesh, plane.feature, pairs_.local(near, at_), near.d) > slack;
}

/// The same where it rests, without the skin.
/// \param slack  of the size; all else is rounding
bool IdealTool::slid_off_at_rest(const Plane& plane, double slack) const {
  const NearPair& near = pairs_[plane.near];
  const ScenePart& part = pairs_.part_of(near);
  slack *= part.mesh->size() + glm::length(near.true_d);
  const Vec3 tip = near.true_tip + part.local_vector(exact_);
  return distance_off(*part.mesh, plane.feature, tip, near.true_d) > slack;
}

/// Goes on to the plane of the next facet of M where the tool, a skin away, is over that facet.
/// Then the way to wherever that plane holds it is free: it stays beyond the plane.
bool IdealTool::slide_on(Plane& plane) {
  const NearPair& near = pairs_[plane.near];
  const ContactFeature next =
      feature_beyond(*pairs_.part_of(near).mesh, plane.feature, pairs_.local(near, at_), near.d);
  if (next.kind == Kind::none) return false;
  Plane beyond = plane_of(plane.near, next);
  if (!(glm::dot(beyond.normal, at_) - beyond.depth > 0) || slid_off(beyond)) return false;
  beyond.stays = true;
  plane = beyond;
  pairs_.state_of(near).feature = beyond.feature;
  return true;
}

/// Whether the pair let go of the ideal tool where that is now, within rounding.
bool IdealTool::parted_here(const NearPair& near) const {
  const double same = kSamePlace * group_.skin;
  const Vec3 apart = at_ - near.parted_at;
  return near.parted && glm::dot(apart, apart) <= same * same;
}

/// Lets go of planes that hold nothing.
void IdealTool::let_go_of_idle_planes() {
  planes_.remove_if([&](const Plane& plane) {
    if (plane.multiplier > 0) return false;
    pairs_[plane.near].carries = false;
    return true;
  });
}

/// Lets go of planes whose facet the tool has slid off. True when there are some.
bool IdealTool::let_go_of_slid_planes(bool at_rest) {
  bool slid = false;
  planes_.remove_if([&](Plane& plane) {
    NearPair& near = pairs_[plane.near];
    if (plane.stays && parted_here(near)) return false;
    if (!(at_rest ? slid_off_at_rest(plane, kAtRest) : slid_off(plane))) return false;
    near.parted = true;
    near.parted_at = at_;
    slid = true;
    if (slide_on(plane)) return false;
    near.carries = false;
    return true;
  });
  return slid;
}

/// Where the tool rests without the skin; sets the multipliers. False where rounding hides it.
bool IdealTool::find_exact_place() {
  return planes_.nearest(Vec3(0), 0, kExact * group_.skin, exact_) ||
         planes_.nearest(Vec3(0), 0, kRounding * group_.skin, exact_);
}

/// Whether planes hold the tool, a skin away, on facets of which it is past one without the skin:
/// those of a groove may end between the two, and leave a gap that is too narrow for the skin.
bool IdealTool::past_a_facet_at_rest() const {
  const std::span<const Plane> all = planes_.all();
  const auto past = [&](const Plane& plane) {
    return plane.stays && plane.multiplier > 0 && slid_off_at_rest(plane, kOnFacet);
  };
  const auto off = [&](const Plane& plane) { return plane.multiplier > 0 && slid_off(plane); };
  return std::any_of(all.begin(), all.end(), past) && std::none_of(all.begin(), all.end(), off);
}

/// Whether the tool, without the skin that keeps it off what holds it, is in another part, which it
/// was less than the skin away from; then the plane that keeps it out.
bool IdealTool::in_the_way_at_rest(Plane& plane) {
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    const NearPair& near = pairs_[i];
    if (near.carries || apart(near, exact_, exact_)) continue;
    const ScenePart& part = pairs_.part_of(near);
    const ContactFeature known = pairs_.state_of(near).feature;
    const Vec3 rest = part.local_vector(exact_), skin = part.local_vector(exact_ - at_);
    if (known.kind != Kind::none &&
        measure(*part.mesh, known, near.true_tip + rest, near.true_d).depth < 0)
      continue;
    const PairCast in =
        cast(pairs_.mesh_of(near), known, near.true_tip + rest - skin, near.true_d, skin);
    if (!in.hit) continue;
    plane = plane_of(i, in.feature);
    if (!(plane.depth - glm::dot(plane.normal, exact_) > kInTheWay * part.tolerance)) continue;
    if (plane.depth - glm::dot(plane.normal, at_) < group_.skin) return true;
  }
  return false;
}

/// Puts the plane of a pair that has none in use.
void IdealTool::take_plane(const Plane& plane) {
  if (planes_.full()) let_go_of_idle_planes();
  stuck_ = planes_.full();
  if (stuck_) return;
  NearPair& near = pairs_[plane.near];
  near.carries = true;
  pairs_.state_of(near).feature = plane.feature;
  planes_.add(plane);
}

void IdealTool::move_to_hit(const Vec3& goal, std::uint32_t index, const PairCast& hit) {
  Plane plane = plane_of(index, hit.feature);
  // It stops a skin before the plane.
  const Vec3 way = goal - at_;
  const double rate = glm::dot(plane.normal, way);
  const double height = glm::dot(plane.normal, at_) - plane.depth;
  const double time = rate < 0 ? std::clamp((height - group_.skin) / -rate, 0.0, hit.time) : 0.0;
  at_ += time * way;
  if (time * glm::length(way) > kSamePlace * group_.skin) {
    let_go_of_idle_planes();
    let_go_of_slid_planes(false);
  }
  plane.stays = parted_here(pairs_[index]);
  take_plane(plane);
}

/// The point nearest to the virtual tool a skin off the planes. In a gap narrower than two skins
/// the tool keeps a share of the skin, or else what it has. False where rounding hides it.
bool IdealTool::find_goal(Vec3& goal) {
  const double skin = group_.skin;
  in_crack_ = false;
  if (planes_.nearest(Vec3(0), skin, kRounding * skin, goal)) return true;
  in_crack_ = planes_.are_a_crack();
  for (double less = kLessSkin * skin; less >= kExact * skin; less *= kLessSkin) {
    if (planes_.nearest(Vec3(0), less, kRounding * less, goal)) return true;
  }
  return planes_.nearest_from(at_, skin, kRounding * skin, kExact * skin, goal);
}

/// Moves the ideal tool as near to the virtual one as the parts let it.
void IdealTool::translate() {
  for (int round = 0; round < kRounds && !stuck_; ++round) {
    Vec3 goal;
    if (!find_goal(goal)) break;
    std::uint32_t near = 0;
    PairCast hit;
    if (next_hit(goal, near, hit)) {
      move_to_hit(goal, near, hit);
      continue;
    }
    at_ = goal;
    let_go_of_idle_planes();
    if (!find_exact_place()) break;
    if (let_go_of_slid_planes(true)) continue;
    if (past_a_facet_at_rest() && !find_goal(exact_)) break;  // the gap is closed to it
    Plane in_the_way;
    if (!in_the_way_at_rest(in_the_way)) return;
    take_plane(in_the_way);
  }
  stuck_ = true;
}

}  // namespace palpate::rendering
