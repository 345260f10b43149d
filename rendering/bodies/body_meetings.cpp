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
  // What touches and parts again, as after a bounce, may meet elsewhere.
  for (const BodyContact& contact : state_.contacts) {
    auto& parts = state_.near_parts[contact.parts];
    if (contact.gap <= kTouching && separation_speed(contact) > resting) parts.apart = true;
  }
  for (auto& parts : state_.near_parts) {
    if (!parts.apart) continue;
    next = std::min(next, parts.touches ? meeting_again(parts, next) : meeting_time(parts, next));
  }
  return next;
}

/// The gap of two parts after a time of free motion.
Gap BodyContacts::gap_after(const BodyWorldState::NearParts& near, double time, GapMemory& memory,
                            Vec3& closing) const {
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
                     place_of(part_b(pair, parts.part_b), {b.centre, b.orientation}), HUGE_VAL,
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
  Vec3 closing(0);
  double time = 0, distance = 0;
  for (int round = 0; round < kMostAdvances; ++round) {
    const Gap gap = gap_after(near, time, memory, closing);
    distance = gap.distance;
    if (distance <= kMet) return time;
    const double fall =
        pair.obstacle ? std::max(0.0, glm::dot(world_.gravity, gap.normal)) * (most - time) : 0;
    const double speed = glm::dot(gap.normal, closing) + turning + fall;
    if (!(speed * (most - time) > distance - kSought)) return most;
    time += (distance - kSought) / speed;
  }
  const TimeAndGap low{time, gap_after(near, time, memory, closing).distance};
  const TimeAndGap high{most, gap_after(near, most, memory, closing).distance};
  if (low.gap <= kMet) return time;
  if (high.gap > kSought) return most;
  return meeting_between(near, low, high, memory);
}

/// Of parts that touch and come apart. The time before which they are apart is looked for from the
/// end on: what is in contact for longer than a thousandth of `most` is held apart instead.
double BodyContacts::meeting_again(BodyWorldState::NearParts& near, double most) {
  GapMemory memory = state_.gaps[near.parts];
  Vec3 closing(0);
  TimeAndGap high{most, gap_after(near, most, memory, closing).distance};
  if (high.gap >= 0) return most;
  for (double time = 0.5 * most; time > 1e-3 * most; time *= 0.5) {
    const TimeAndGap low{time, gap_after(near, time, memory, closing).distance};
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
    const double value = gap_after(near, middle, memory, closing).distance - kSought;
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
