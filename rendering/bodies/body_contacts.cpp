#include "rendering/bodies/body_contacts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_world.h"

namespace palpate::rendering {

Pose BodyContacts::pose_of(std::uint32_t body) const {
  return {state_.motion[body].centre, state_.motion[body].orientation};
}

Pose BodyContacts::pose_of_other(const BodyPair& pair) const {
  return pair.obstacle ? Pose{} : pose_of(pair.b);
}

const CollidingPart& BodyContacts::part_b(const BodyPair& pair, std::uint32_t part) const {
  return pair.obstacle ? world_.obstacles[pair.b].parts[part] : world_.bodies[pair.b].parts[part];
}

void BodyContacts::find(double within, double extra, std::span<const char> chosen) {
  do look_for(within, extra, chosen, true);
  while (wake_near());
}

void BodyContacts::find_near(double within, double extra) {
  do look_for(within, extra, {}, false);
  while (wake_near());
}

bool BodyContacts::may_touch(std::uint32_t body, double within, double extra) {
  begin_search();
  for (std::uint32_t index = 0; index < world_.pairs.size() && state_.near_parts.empty(); ++index) {
    const BodyPair& pair = world_.pairs[index];
    if (pair.a == body || (!pair.obstacle && pair.b == body))
      look_at_pair(index, within, extra, false);
  }
  return !state_.near_parts.empty();
}

/// An awake body wakes every body that it may touch, with the whole sleeping group.
bool BodyContacts::wake_near() {
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

void BodyContacts::begin_search() {
  state_.near.clear();
  state_.near_parts.clear();
  state_.contacts.clear();
  for (std::size_t i = 0; i < world_.bodies.size(); ++i)
    state_.spin[i] =
        state_.sleep[i].asleep ? Vec3(0) : spin_of(world_.bodies[i].inertia, state_.motion[i]);
  std::fill(state_.placed.begin(), state_.placed.end(), 0);
}

void BodyContacts::look_for(double within, double extra, std::span<const char> chosen,
                            bool places) {
  begin_search();
  for (std::uint32_t index = 0; index < world_.pairs.size(); ++index) {
    const BodyPair& pair = world_.pairs[index];
    if (state_.sleep[pair.a].asleep && (pair.obstacle || state_.sleep[pair.b].asleep)) continue;
    if (!chosen.empty() && !chosen[pair.a] && (pair.obstacle || !chosen[pair.b])) continue;
    look_at_pair(index, within, extra, places);
  }
}

void BodyContacts::look_at_pair(std::uint32_t index, double within, double extra, bool places) {
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

void BodyContacts::place_parts(std::uint32_t body) {
  if (state_.placed[body]) return;
  state_.placed[body] = 1;
  const Mat3 axes = glm::mat3_cast(state_.motion[body].orientation);
  Vec3* centre = &state_.part_centres[world_.first_part[body]];
  for (const CollidingPart& part : world_.bodies[body].parts)
    *centre++ = axes * part.centre + state_.motion[body].centre;
}

/// m, at most, that any point of the pair's bodies has moved since their distances were measured.
double BodyContacts::moved_since(const BodyPair& pair, const PairPlaces& measured) const {
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

void BodyContacts::find_in_pair(std::uint32_t index, double within, double extra, bool places) {
  const BodyPair& pair = world_.pairs[index];
  const MovingBody& body_a = world_.bodies[pair.a];
  const Vec3 velocity = pair.obstacle ? Vec3(0) : state_.motion[pair.b].velocity;
  const double turning =
      glm::length(state_.spin[pair.a]) * body_a.radius +
      (pair.obstacle ? 0 : glm::length(state_.spin[pair.b]) * world_.bodies[pair.b].radius);
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
    if (looked_for && !(memory.least > reach)) measure_parts(index, pair.first + k, reach, places);
    measured.least = std::min(measured.least, memory.least);
  }
}

/// Measures the gap of two parts and, if they are within reach, finds the places where they touch
/// or may touch.
void BodyContacts::measure_parts(std::uint32_t index, std::uint32_t parts_index, double reach,
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
  for (const ManifoldPoint& point : state_.manifold.points()) {
    if (state_.contacts.size() == BodyWorldState::kMostContacts) {
      state_.dropped = true;
      return;
    }
    state_.contacts.push_back({pair.a, pair.obstacle ? BodyContact::kStands : pair.b, index,
                               point.place, state_.manifold.normal, point.gap,
                               static_cast<std::uint32_t>(state_.near_parts.size() - 1)});
  }
}

double BodyContacts::separation_speed(const BodyContact& contact) const {
  const auto velocity = [&](std::uint32_t body) {
    return body == BodyContact::kStands
               ? Vec3(0)
               : state_.velocity[body] +
                     glm::cross(state_.spin[body], contact.place - state_.motion[body].centre);
  };
  return glm::dot(contact.normal, velocity(contact.b) - velocity(contact.a));
}

/// The velocities after a step without impulses; the present ones for a step of 0.
void BodyContacts::set_velocities(double step) {
  for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
    if (state_.sleep[i].asleep) continue;  // nothing touches it
    const MovingBody& body = world_.bodies[i];
    BodyMotion motion = state_.motion[i];
    state_.per_inertia[i] = world_per_inertia(body.inertia, motion.orientation);
    const double left = std::exp(-body.of.damping * step);
    state_.spin[i] = left * (state_.per_inertia[i] * motion.spin_momentum);
    motion.spin_momentum = Vec3(0);
    move_freely(body.inertia, world_.gravity, body.of.damping, step, motion);
    state_.velocity[i] = motion.velocity;
  }
}

/// Joins bodies that contacts connect. A spring holds one body and connects none.
void BodyContacts::find_islands() {
  for (std::uint32_t i = 0; i < state_.island.size(); ++i) state_.island[i] = i;
  for (bool more = true; more;) {
    more = false;
    for (const BodyContact& contact : state_.contacts) {
      if (contact.b == BodyContact::kStands) continue;
      std::uint32_t &a = state_.island[contact.a], &b = state_.island[contact.b];
      if (a == b) continue;
      a = b = std::min(a, b);
      more = true;
    }
  }
}

/// m/s; slower approaches do not bounce.
double BodyContacts::resting_speed(double step) const {
  return 2 * glm::length(world_.gravity) * step + 1e-9;
}
}  // namespace palpate::rendering
