#include "rendering/bodies/body_world.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_meetings.h"
#include "rendering/bodies/contact_impulses.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

constexpr int kMostEvents = 32;  // in a step; later meetings are held apart without a bounce

Vec3 velocity_after(const BodyWorld& world, const MovingBody& body, const Vec3& velocity,
                    double duration) {
  BodyMotion motion;
  motion.velocity = velocity;
  move_freely(body.inertia, world.gravity, body.of.damping, duration, motion);
  return motion.velocity;
}

/// Moves a body by the velocity that impulses have given it.
void move_pushed(const MovingBody& body, double duration, BodyMotion& motion) {
  motion.centre += duration * motion.velocity;
  motion.orientation =
      turned_freely(body.inertia, motion.spin_momentum, motion.orientation, duration);
}

/// Applies gravity and damping to the velocities alone.
void accelerate(const BodyWorld& world, const MovingBody& body, double duration,
                BodyMotion& motion) {
  motion.velocity = velocity_after(world, body, motion.velocity, duration);
  if (body.of.damping > 0) motion.spin_momentum *= std::exp(-body.of.damping * duration);
}

void move_all(const BodyWorld& world, BodyWorldState& state, double duration) {
  BodyMeetings meetings(world, state);
  ContactImpulses impulses(world, state);
  double left = duration;
  for (int event = 0; left > 0; ++event) {
    meetings.find(left);
    if (state.near.empty()) {
      for (std::size_t i = 0; i < world.bodies.size(); ++i) {
        if (state.sleep[i].asleep) continue;
        move_freely(world.bodies[i].inertia, world.gravity, world.bodies[i].of.damping, left,
                    state.motion[i]);
      }
      return;
    }
    if (impulses.bounce(left, duration)) meetings.find(left);
    const double next = event < kMostEvents ? meetings.time_to_next(left) : left;
    // Impulses act on the velocities at the end of the step; bodies without impulses move freely.
    impulses.hold_apart(next, {});
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
      if (state.sleep[i].asleep) continue;
      const MovingBody& body = world.bodies[i];
      if (state.pushed[i]) {
        accelerate(world, body, next, state.motion[i]);
        impulses.add_impulses(i);
        move_pushed(body, next, state.motion[i]);
      } else {
        move_freely(body.inertia, world.gravity, body.of.damping, next, state.motion[i]);
      }
    }
    left -= next;
    if (left < 1e-12 * duration) break;
  }
}

constexpr double kRestBefore = 0.5;  // s
constexpr double kNowhere = 1e-6;    // m, of any point of the body in that time
constexpr double kInTouch = 1e-6;    // m

bool has_stopped(const BodyWorld& world, const MovingBody& body, const BodyMotion& motion,
                 const SleepState& sleep) {
  const Quat turn = motion.orientation * glm::conjugate(sleep.orientation);
  const double moved = glm::distance(motion.centre, sleep.centre) +
                       2 * body.radius * glm::length(Vec3(turn.x, turn.y, turn.z));
  if (!(moved <= kNowhere)) return false;
  return world.gravity != Vec3(0) || body.of.damping > 0 ||
         (motion.velocity == Vec3(0) && motion.spin_momentum == Vec3(0));
}

/// Sets state.island from the contacts.
void join_touching(const BodyWorld& world, BodyWorldState& state) {
  for (std::uint32_t i = 0; i < state.island.size(); ++i) state.island[i] = i;
  for (bool more = true; more;) {
    more = false;
    for (const auto& parts : state.near_parts) {
      const BodyPair& pair = world.pairs[parts.pair];
      if (pair.obstacle || parts.gap > kInTouch) continue;
      std::uint32_t &a = state.island[pair.a], &b = state.island[pair.b];
      if (a == b) continue;
      a = b = std::min(a, b);
      more = true;
    }
  }
}

}  // namespace

void BodyWorld::pair_up() {
  pairs.clear();
  part_pairs.clear();
  first_part.assign(1, 0);
  for (const MovingBody& body : bodies)
    first_part.push_back(first_part.back() + static_cast<std::uint32_t>(body.parts.size()));
  const auto add = [this](std::uint32_t a, std::uint32_t b, bool obstacle, const auto& other) {
    const std::size_t parts_of_b = other.parts.size();
    const bool by_surface = bodies[a].parts.empty() || parts_of_b == 0;
    if (by_surface && (bodies[a].surface == nullptr || other.surface == nullptr)) return;
    BodyPair pair;
    pair.a = a;
    pair.b = b;
    pair.obstacle = obstacle;
    pair.first = static_cast<std::uint32_t>(part_pairs.size());
    const stimuli::Body& of_a = bodies[a].of;
    const stimuli::Body& of_b = obstacle ? of_a : bodies[b].of;
    pair.restitution = std::sqrt(of_a.restitution * of_b.restitution);
    pair.friction = std::sqrt(of_a.friction * of_b.friction);
    pair.by_surface = by_surface;
    if (pair.by_surface) part_pairs.emplace_back();
    for (std::uint32_t i = 0; i < bodies[a].parts.size() && !by_surface; ++i) {
      for (std::uint32_t k = 0; k < parts_of_b; ++k) part_pairs.push_back({i, k});
    }
    pair.count = static_cast<std::uint32_t>(part_pairs.size()) - pair.first;
    pairs.push_back(pair);
  };
  for (std::uint32_t a = 0; a < bodies.size(); ++a) {
    for (std::uint32_t b = a + 1; b < bodies.size(); ++b) add(a, b, false, bodies[b]);
    for (std::uint32_t k = 0; k < obstacles.size(); ++k) add(a, k, true, obstacles[k]);
  }
}

void BodyWorldState::make_room() {
  near.reserve(most_pairs);
  near_parts.reserve(most_parts);
  contacts.reserve(kMostContacts);
  rows.reserve(ComplementarityProblem::kMostRows);
  problem.make_room();
  for (std::vector<Vec3>* polygon : {&clip.polygon, &clip.next}) polygon->reserve(most_corners);
  clip.points.reserve(most_corners);
  if (has_surfaces) places.make_room();
}

BodyWorldState initial_state(const BodyWorld& world) {
  BodyWorldState state;
  const std::size_t count = world.bodies.size();
  for (const MovingBody& body : world.bodies) state.motion.push_back(body.start);
  state.gaps.resize(world.part_pairs.size());
  state.measured.resize(world.pairs.size());
  state.sleep.resize(count);
  state.island.resize(count);
  state.velocity.resize(count);
  state.spin.resize(count);
  state.push.resize(count);
  state.twist.resize(count);
  state.per_inertia.resize(count);
  state.pushed.resize(count);
  state.placed.resize(count);
  state.part_centres.resize(world.first_part.empty() ? 0 : world.first_part.back());
  std::size_t most_sides = 0;
  const auto look = [&most_sides](const std::vector<CollidingPart>& parts) {
    for (const CollidingPart& part : parts) {
      for (const stimuli::Facet& facet : part.mesh->facets())
        most_sides = std::max<std::size_t>(most_sides, facet.side_count);
    }
  };
  for (const MovingBody& body : world.bodies) look(body.parts);
  for (const Obstacle& obstacle : world.obstacles) look(obstacle.parts);
  state.most_pairs = world.pairs.size();
  state.most_parts = world.part_pairs.size();
  state.has_surfaces = std::any_of(world.pairs.begin(), world.pairs.end(),
                                   [](const auto& p) { return p.by_surface; });
  state.most_corners = 2 * most_sides + 2;  // each side of a facet adds at most one corner
  state.make_room();
  return state;
}

ConvexPlace place_of(const CollidingPart& part, const Pose& frame) {
  ConvexPlace place;
  place.mesh = part.mesh.get();
  place.axes = glm::mat3_cast(frame.orientation * part.pose.orientation);
  place.position = frame.orientation * part.pose.position + frame.position;
  place.inside = part.inside;
  return place;
}

SurfacePlace place_of(const stimuli::CollisionSurface& surface, const Pose& frame) {
  return {&surface, glm::mat3_cast(frame.orientation), frame.position};
}

void step_bodies(const BodyWorld& world, BodyWorldState& state, double duration) {
  if (state.sleeping == world.bodies.size()) return;
  move_all(world, state, duration);
  fall_asleep(world, state, duration);
}

void step_pressed(const BodyWorld& world, BodyWorldState& state, std::span<const char> chosen,
                  std::span<PressingSpring> springs, double duration) {
  ContactImpulses impulses(world, state);
  double deepest = 0;  // no spring pushes farther
  for (const PressingSpring& spring : springs) deepest = std::max(deepest, spring.depth);
  BodyMeetings(world, state).find(duration, deepest, chosen);
  impulses.hold_apart(duration, springs);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    if (!chosen[i]) continue;
    accelerate(world, world.bodies[i], duration, state.motion[i]);
    impulses.add_impulses(i);
    move_pushed(world.bodies[i], duration, state.motion[i]);
  }
}

bool mark_connected(const BodyWorld& world, BodyWorldState& state, double duration, double distance,
                    std::span<char> marked) {
  BodyMeetings(world, state).find_near(duration, distance);
  bool touches = false;
  for (bool more = true; more;) {
    more = false;
    for (const BodyWorldState::NearParts& parts : state.near_parts) {
      const BodyPair& pair = world.pairs[parts.pair];
      const bool a = marked[pair.a] != 0, b = !pair.obstacle && marked[pair.b] != 0;
      touches |= a || b;
      if (pair.obstacle || a == b) continue;
      marked[pair.a] = marked[pair.b] = 1;
      more = true;
    }
  }
  return touches;
}

bool touches_nothing(const BodyWorld& world, BodyWorldState& state, std::uint32_t body,
                     double duration, double distance) {
  return !BodyMeetings(world, state).may_touch(body, duration, distance);
}

void fall_asleep(const BodyWorld& world, BodyWorldState& state, double duration) {
  if (!world.sleeps) return;
  bool any = false;
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    SleepState& sleep = state.sleep[i];
    if (sleep.asleep) continue;
    if (has_stopped(world, world.bodies[i], state.motion[i], sleep)) {
      sleep.rested += duration;
      any |= sleep.rested >= kRestBefore;
    } else {
      sleep = {false, 0, static_cast<std::uint32_t>(i), state.motion[i].centre,
               state.motion[i].orientation};
    }
  }
  if (!any) return;
  join_touching(world, state);
  for (std::uint32_t group = 0; group < state.island.size(); ++group) {
    if (state.island[group] != group || state.sleep[group].asleep) continue;
    bool rests = true;
    for (std::size_t i = group; i < state.island.size(); ++i)
      rests &= state.island[i] != group || state.sleep[i].rested >= kRestBefore;
    if (!rests) continue;
    for (std::size_t i = group; i < state.island.size(); ++i) {
      if (state.island[i] != group) continue;
      state.sleep[i].asleep = true;
      state.sleep[i].group = group;
      state.motion[i].velocity = state.motion[i].spin_momentum = Vec3(0);
      ++state.sleeping;
    }
  }
}

void wake(BodyWorldState& state, std::uint32_t body) {
  if (!state.sleep[body].asleep) {
    state.sleep[body].rested = 0;
    return;
  }
  const std::uint32_t group = state.sleep[body].group;
  for (SleepState& sleep : state.sleep) {
    if (!sleep.asleep || sleep.group != group) continue;
    sleep.asleep = false;
    sleep.rested = 0;
    --state.sleeping;
  }
}

}  // namespace palpate::rendering
