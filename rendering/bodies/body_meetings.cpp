#include "rendering/bodies/body_meetings.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

// m; the gap that the search aims at; any up to kMet is accepted.
constexpr double kSought = 0.5 * BodyMeetings::kTouching;

}  // namespace

double separation_speed(const BodyWorldState& state, const BodyContact& contact) {
  const auto velocity = [&](std::uint32_t body) {
    return body == BodyContact::kStands
               ? Vec3(0)
               : state.velocity[body] +
                     glm::cross(state.spin[body], contact.place - state.motion[body].centre);
  };
  return glm::dot(contact.normal, velocity(contact.b) - velocity(contact.a));
}

double resting_speed(const BodyWorld& world, double step) {
  return 2 * glm::length(world.gravity) * step + 1e-9;
}

Pose BodyMeetings::pose_of(std::uint32_t body) const {
  return {state_.motion[body].centre, state_.motion[body].orientation};
}

Pose BodyMeetings::pose_of_other(const BodyPair& pair) const {
  return pair.obstacle ? Pose{} : pose_of(pair.b);
}

const CollidingPart& BodyMeetings::part_b(const BodyPair& pair, std::uint32_t part) const {
  return pair.obstacle ? world_.obstacles[pair.b].parts[part] : world_.bodies[pair.b].parts[part];
}

void BodyMeetings::find(double within, double extra, std::span<const char> chosen) {
  do look_for(within, extra, chosen, true);
  while (wake_near());
}

void BodyMeetings::find_near(double within, double extra) {
  do look_for(within, extra, {}, false);
  while (wake_near());
}

bool BodyMeetings::may_touch(std::uint32_t body, double within, double extra) {
  begin_search();
  for (std::uint32_t index = 0; index < world_.pairs.size() && state_.near_parts.empty(); ++index) {
    const BodyPair& pair = world_.pairs[index];
    if (pair.a == body || (!pair.obstacle && pair.b == body))
      look_at_pair(index, within, extra, false);
  }
  return !state_.near_parts.empty();
}

/// An awake body wakes every body that it may touch, with the whole sleeping group.
bool BodyMeetings::wake_near() {
  if (state_.sleeping == 0) return false;
  const std::size_t before = state_.sleeping;
  for (const auto& parts : state_.near_parts) {
    const BodyPair& pair = world_.pairs[parts.pair];
    if (pair.obstacle) continue;
    for (const std::uint32_t body : {pair.a, pair.b}) {
      if (state_.sleep[body].asleep) wake(state_, body);
    }
  }
  return state_.sleeping < before;
}

void BodyMeetings::begin_search() {
  state_.near.clear();
  state_.near_parts.clear();
  state_.contacts.clear();
  for (std::size_t i = 0; i < world_.bodies.size(); ++i)
    state_.spin[i] =
        state_.sleep[i].asleep ? Vec3(0) : spin_of(world_.bodies[i].inertia, state_.motion[i]);
  std::fill(state_.placed.begin(), state_.placed.end(), 0);
}

void BodyMeetings::look_for(double within, double extra, std::span<const char> chosen,
                            bool places) {
  begin_search();
  for (std::uint32_t index = 0; index < world_.pairs.size(); ++index) {
    const BodyPair& pair = world_.pairs[index];
    if (state_.sleep[pair.a].asleep && (pair.obstacle || state_.sleep[pair.b].asleep)) continue;
    if (!chosen.empty() && !chosen[pair.a] && (pair.obstacle || !chosen[pair.b])) continue;
    look_at_pair(index, within, extra, places);
  }
}

void BodyMeetings::look_at_pair(std::uint32_t index, double within, double extra, bool places) {
  const BodyPair& pair = world_.pairs[index];
  const double fall = glm::length(world_.gravity) * within * within;
  const BodyMotion& a = state_.motion[pair.a];
  const Vec3 centre =
      pair.obstacle ? world_.obstacles[pair.b].centre : state_.motion[pair.b].centre;
  const Vec3 velocity = pair.obstacle ? Vec3(0) : state_.motion[pair.b].velocity;
  const double radii =
      world_.bodies[pair.a].radius +
      (pair.obstacle ? world_.obstacles[pair.b].radius : world_.bodies[pair.b].radius);
  const double reach = radii + kTouching + extra + (pair.obstacle ? fall : 0) +
                       within * glm::length(velocity - a.velocity);
  const Vec3 apart = centre - a.centre;
  if (glm::dot(apart, apart) > reach * reach) return;
  find_in_pair(index, within, extra + (pair.obstacle ? fall : 0), places);
}

void BodyMeetings::place_parts(std::uint32_t body) {
  if (state_.placed[body]) return;
  state_.placed[body] = 1;
  const Mat3 axes = glm::mat3_cast(state_.motion[body].orientation);
  Vec3* centre = &state_.part_centres[world_.first_part[body]];
  for (const CollidingPart& part : world_.bodies[body].parts)
    *centre++ = axes * part.centre + state_.motion[body].centre;
}

/// m, at most, that any point of the pair's bodies has moved since their distances were measured.
double BodyMeetings::moved_since(const BodyPair& pair, const PairPlaces& measured) const {
  const auto moved = [this](std::uint32_t body, const Vec3& centre, const Quat& orientation) {
    const BodyMotion& motion = state_.motion[body];
    // Unit quaternions: the chord of a turn by t is 2 sin(t/4), that of a point's path 2 radius
    // sin(t/2).
    const Quat turn = motion.orientation - orientation;
    return glm::distance(motion.centre, centre) +
           2 * world_.bodies[body].radius * std::sqrt(glm::dot(turn, turn));
  };
  return moved(pair.a, measured.centre_a, measured.orientation_a) +
         (pair.obstacle ? 0 : moved(pair.b, measured.centre_b, measured.orientation_b));
}

void BodyMeetings::find_in_pair(std::uint32_t index, double within, double extra, bool places) {
  const BodyPair& pair = world_.pairs[index];
  const MovingBody& body_a = world_.bodies[pair.a];
  const Vec3 velocity = pair.obstacle ? Vec3(0) : state_.motion[pair.b].velocity;
  const double turning = turning_of(pair);
  const double spins =
      glm::length(state_.spin[pair.a] - (pair.obstacle ? Vec3(0) : state_.spin[pair.b]));
  const double reach = 2 * kTouching + extra +
                       within * (glm::length(velocity - state_.motion[pair.a].velocity) + turning);
  PairPlaces& measured = state_.measured[index];
  const double moved = moved_since(pair, measured) + 1e-12 * body_a.radius;  // above rounding
  if (measured.least - moved > reach) return;
  state_.near.push_back(index);
  place_parts(pair.a);
  if (!pair.obstacle) place_parts(pair.b);
  measured = {state_.motion[pair.a].centre, pair.obstacle ? Vec3(0) : state_.motion[pair.b].centre,
              state_.motion[pair.a].orientation,
              pair.obstacle ? Quat(1, 0, 0, 0) : state_.motion[pair.b].orientation, HUGE_VAL};
  for (std::uint32_t k = 0; k < pair.count; ++k) {
    GapMemory& memory = state_.gaps[pair.first + k];
    memory.least -= moved;
    const bool looked_for =
        places || state_.near_parts.empty() || state_.near_parts.back().pair != index;
    if (looked_for && !(memory.least > reach)) {
      if (pair.by_surface)
        measure_surfaces(index, reach, within * spins, places);
      else
        measure_parts(index, pair.first + k, reach, places);
    }
    measured.least = std::min(measured.least, memory.least);
  }
}

/// Measures the gap of two parts and, if they are within reach, finds the places where they touch
/// or may touch.
void BodyMeetings::measure_parts(std::uint32_t index, std::uint32_t parts_index, double reach,
                                 bool places) {
  const BodyPair& pair = world_.pairs[index];
  const PartPair& parts = world_.part_pairs[parts_index];
  GapMemory& memory = state_.gaps[parts_index];
  const CollidingPart &a = world_.bodies[pair.a].parts[parts.part_a],
                      &b = part_b(pair, parts.part_b);
  const Vec3& centre_a = state_.part_centres[world_.first_part[pair.a] + parts.part_a];
  const Vec3& centre_b =
      pair.obstacle ? b.centre : state_.part_centres[world_.first_part[pair.b] + parts.part_b];
  memory.least = glm::distance(centre_a, centre_b) - a.mesh->radius() - b.mesh->radius();
  if (memory.least > reach) return;
  const ConvexPlace at_a = place_of(a, pose_of(pair.a)), at_b = place_of(b, pose_of_other(pair));
  const Gap gap = gap_between(at_a, at_b, reach, memory);
  memory.least = gap.distance;
  if (gap.distance > reach) return;
  state_.near_parts.push_back({index, parts_index, gap.distance, gap.distance <= kTouching});
  if (!places) return;
  find_manifold(at_a, at_b, gap, reach, memory, state_.clip, state_.manifold);
  for (const ManifoldPoint& point : state_.manifold.points())
    add_contact(index, point.place, state_.manifold.normal, point.gap);
}

/// \param normal  from a to b
void BodyMeetings::add_contact(std::uint32_t index, const Vec3& place, const Vec3& normal,
                               double gap) {
  if (state_.contacts.size() == BodyWorldState::kMostContacts) {
    state_.dropped = true;
    return;
  }
  const BodyPair& pair = world_.pairs[index];
  state_.contacts.push_back({pair.a, pair.obstacle ? BodyContact::kStands : pair.b, index, place,
                             normal, gap,
                             static_cast<std::uint32_t>(state_.near_parts.size() - 1)});
}

const stimuli::CollisionSurface& BodyMeetings::surface_b(const BodyPair& pair) const {
  return pair.obstacle ? *world_.obstacles[pair.b].surface : *world_.bodies[pair.b].surface;
}

/// The same of two surfaces.
/// \param turn  rad, by which they may turn against each other
void BodyMeetings::measure_surfaces(std::uint32_t index, double reach, double turn, bool places) {
  const BodyPair& pair = world_.pairs[index];
  const SurfacePlace a = place_of(*world_.bodies[pair.a].surface, pose_of(pair.a)),
                     b = place_of(surface_b(pair), pose_of_other(pair));
  NearPlaces& found = state_.places;
  constexpr double kRocks = 0.01;  // rad; contact forces may turn them by this much more
  GapLimits limits{.reach = reach};
  limits.depth += reach;
  double gap = places ? find_places(a, b, limits, turn + kRocks, found) : gap_between(a, b, limits);
  // Moving overlapping bodies apart may close a gap elsewhere.
  if (places && gap < -kTouching) {
    limits.reach -= 4 * gap;
    gap = find_places(a, b, limits, turn + kRocks, found);
  }
  state_.gaps[pair.first].least = gap;
  if (gap > reach) return;
  state_.near_parts.push_back({index, pair.first, gap, gap <= kTouching});
  if (!places) return;
  state_.dropped |= found.dropped;
  for (const NearPlace& place : found.chosen)
    add_contact(index, place.place, place.normal, place.gap);
}

/// m/s, at most, of any point against any other by the turn of both.
double BodyMeetings::turning_of(const BodyPair& pair) const {
  return glm::length(state_.spin[pair.a]) * world_.bodies[pair.a].radius +
         (pair.obstacle ? 0 : glm::length(state_.spin[pair.b]) * world_.bodies[pair.b].radius);
}

// The time to the next meeting.

double BodyMeetings::time_to_next(double most) {
  const double resting = resting_speed(world_, most);
  double next = most;
  for (auto& parts : state_.near_parts) parts.apart = !parts.touches;
  // Parts that touch and separate, as after a bounce, may meet elsewhere. Parts that overlap by
  // more than they separate do not come free.
  for (const BodyContact& contact : state_.contacts) {
    const double speed = separation_speed(state_, contact);
    if (contact.gap <= kTouching && speed > resting && contact.gap + most * speed > kTouching)
      state_.near_parts[contact.parts].apart = true;
  }
  for (auto& parts : state_.near_parts) {
    if (!parts.apart) continue;
    next = std::min(next, parts.touches ? meeting_again(parts, next) : meeting_time(parts, next));
  }
  return next;
}

/// The gap of two parts after a time of free motion.
Gap BodyMeetings::gap_after(const BodyWorldState::NearParts& near, double time, double enough,
                            GapMemory& memory, Vec3& closing) const {
  const BodyPair& pair = world_.pairs[near.pair];
  const PartPair& parts = world_.part_pairs[near.parts];
  const auto moved = [&](std::uint32_t body) {
    BodyMotion motion = state_.motion[body];
    move_freely(world_.bodies[body].inertia, world_.gravity, world_.bodies[body].of.damping, time,
                motion);
    return motion;
  };
  const BodyMotion a = moved(pair.a), b = pair.obstacle ? BodyMotion{} : moved(pair.b);
  closing = a.velocity - b.velocity;
  if (pair.by_surface) {
    constexpr double kFarthest = 1e-2;  // m
    GapLimits limits{.reach = std::min(enough, kFarthest)};
    limits.depth += time * (glm::length(closing) + turning_of(pair));
    Gap gap;
    gap.distance = gap_between(
        place_of(*world_.bodies[pair.a].surface, {a.centre, a.orientation}),
        place_of(surface_b(pair), pair.obstacle ? Pose{} : Pose{b.centre, b.orientation}), limits);
    return gap;
  }
  return gap_between(place_of(world_.bodies[pair.a].parts[parts.part_a], {a.centre, a.orientation}),
                     place_of(part_b(pair, parts.part_b), {b.centre, b.orientation}), enough,
                     memory);
}

/// Conservative advancement (Mirtich 1996): repeatedly advances by a time in which the pair cannot
/// meet. If that is slow, as for bodies that turn, finds the time in the rest of the step by false
/// position (Illinois).
double BodyMeetings::meeting_time(const BodyWorldState::NearParts& near, double most) {
  constexpr int kMostAdvances = 6;
  const BodyPair& pair = world_.pairs[near.pair];
  const double turning = turning_of(pair);
  GapMemory memory = state_.gaps[near.parts];
  const double falling = pair.obstacle ? glm::length(world_.gravity) : 0;
  // The first round uses the results of find().
  Vec3 closing =
      state_.motion[pair.a].velocity - (pair.obstacle ? Vec3(0) : state_.motion[pair.b].velocity);
  Gap gap;
  gap.normal = memory.normal;
  gap.distance = near.gap;
  double time = 0;
  for (int round = 0; round < kMostAdvances; ++round) {
    const double left = most - time;
    if (round > 0) {
      // From a larger distance they do not meet.
      const double enough = kSought + left * (glm::length(closing) + turning + 2 * falling * most);
      gap = gap_after(near, time, enough, memory, closing);
    }
    if (gap.distance <= kMet) return time;
    // Surfaces may meet in any direction.
    const double fall = pair.by_surface ? falling * left
                        : pair.obstacle ? std::max(0.0, glm::dot(world_.gravity, gap.normal)) * left
                                        : 0;
    const double speed =
        (pair.by_surface ? glm::length(closing) : glm::dot(gap.normal, closing)) + turning + fall;
    if (!(speed * left > gap.distance - kSought)) return most;
    time += (gap.distance - kSought) / speed;
  }
  const TimeAndGap low{time, gap_after(near, time, HUGE_VAL, memory, closing).distance};
  const TimeAndGap high{most, gap_after(near, most, kTouching, memory, closing).distance};
  if (low.gap <= kMet) return time;
  if (high.gap > kSought) return most;
  return meeting_between(near, low, high, memory);
}

/// The same for parts that touch and separate. Searches backwards from the end for a time at which
/// they are apart; parts that touch at all times tried, down to a thousandth of `most`, are held
/// apart instead.
double BodyMeetings::meeting_again(BodyWorldState::NearParts& near, double most) {
  GapMemory memory = state_.gaps[near.parts];
  Vec3 closing(0);
  TimeAndGap high{most, gap_after(near, most, 0, memory, closing).distance};
  if (high.gap >= 0) return most;
  for (double time = 0.5 * most; time > 1e-3 * most; time *= 0.5) {
    const TimeAndGap low{time, gap_after(near, time, HUGE_VAL, memory, closing).distance};
    if (low.gap > kTouching) return meeting_between(near, low, high, memory);
    high = low;
  }
  near.apart = false;
  return most;
}

/// False position (Illinois). \param low  where the parts are apart \param high  where they overlap
double BodyMeetings::meeting_between(const BodyWorldState::NearParts& near, TimeAndGap low,
                                     TimeAndGap high, GapMemory& memory) const {
  constexpr int kMostRounds = 24;
  Vec3 closing(0);
  low.gap -= kSought;
  high.gap -= kSought;
  for (int round = 0; round < kMostRounds; ++round) {
    const double middle = (low.time * high.gap - high.time * low.gap) / (high.gap - low.gap);
    const double value = gap_after(near, middle, HUGE_VAL, memory, closing).distance - kSought;
    if (std::abs(value) <= kMet - kSought) return middle;
    if (value > 0) {
      low = {middle, value};
      high.gap *= 0.5;
    } else {
      high = {middle, value};
      low.gap *= 0.5;
    }
  }
  return low.time;
}

}  // namespace palpate::rendering
