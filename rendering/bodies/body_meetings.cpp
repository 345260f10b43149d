// When bodies meet. Part of body_contacts.h.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_contacts.h"

namespace palpate::rendering {
namespace {

// m; the gap that is looked for. One up to kMet will do.
constexpr double kSought = 0.5 * BodyContacts::kTouching;

}  // namespace

double BodyContacts::time_to_next(double most) {
  const double resting = resting_speed(most);
  double next = most;
  for (auto& parts : state_.near_parts) parts.apart = !parts.touches;
  // What touches and parts again, as after a bounce, may meet elsewhere. What overlaps by more than
  // it parts does not come out.
  for (const BodyContact& contact : state_.contacts) {
    const double speed = separation_speed(contact);
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
Gap BodyContacts::gap_after(const BodyWorldState::NearParts& near, double time, double enough,
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
  return gap_between(place_of(world_.bodies[pair.a].parts[parts.part_a], {a.centre, a.orientation}),
                     place_of(part_b(pair, parts.part_b), {b.centre, b.orientation}), enough,
                     memory);
}

/// Conservative advancement (Mirtich 1996): as far as the pair can not meet, again and again. Where
/// that is slow, as for bodies that turn, the time is found between there and the end by false
/// position (Illinois).
double BodyContacts::meeting_time(const BodyWorldState::NearParts& near, double most) {
  constexpr int kMostAdvances = 6;
  const BodyPair& pair = world_.pairs[near.pair];
  const double turning =
      glm::length(state_.spin[pair.a]) * world_.bodies[pair.a].radius +
      (pair.obstacle ? 0 : glm::length(state_.spin[pair.b]) * world_.bodies[pair.b].radius);
  GapMemory memory = state_.gaps[near.parts];
  const double falling = pair.obstacle ? glm::length(world_.gravity) : 0;
  // What find() knows is the first round's.
  Vec3 closing =
      state_.motion[pair.a].velocity - (pair.obstacle ? Vec3(0) : state_.motion[pair.b].velocity);
  Gap gap;
  gap.normal = memory.normal;
  gap.distance = near.gap;
  double time = 0;
  for (int round = 0; round < kMostAdvances; ++round) {
    const double left = most - time;
    if (round > 0) {
      // From farther away they do not meet.
      const double enough = kSought + left * (glm::length(closing) + turning + 2 * falling * most);
      gap = gap_after(near, time, enough, memory, closing);
    }
    if (gap.distance <= kMet) return time;
    const double fall =
        pair.obstacle ? std::max(0.0, glm::dot(world_.gravity, gap.normal)) * left : 0;
    const double speed = glm::dot(gap.normal, closing) + turning + fall;
    if (!(speed * left > gap.distance - kSought)) return most;
    time += (gap.distance - kSought) / speed;
  }
  const TimeAndGap low{time, gap_after(near, time, HUGE_VAL, memory, closing).distance};
  const TimeAndGap high{most, gap_after(near, most, kTouching, memory, closing).distance};
  if (low.gap <= kMet) return time;
  if (high.gap > kSought) return most;
  return meeting_between(near, low, high, memory);
}

/// Of parts that touch and come apart. The time before which they are apart is looked for from the
/// end on: what is in contact for longer than a thousandth of `most` is held apart instead.
double BodyContacts::meeting_again(BodyWorldState::NearParts& near, double most) {
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
double BodyContacts::meeting_between(const BodyWorldState::NearParts& near, TimeAndGap low,
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
