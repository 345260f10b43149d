#include "rendering/bodies/body_world.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

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
  BodyContacts contacts(world, state);
  double left = duration;
  for (int event = 0; left > 0; ++event) {
    contacts.find(left);
    if (state.near.empty()) {
      for (std::size_t i = 0; i < world.bodies.size(); ++i) {
        if (state.sleep[i].asleep) continue;
        move_freely(world.bodies[i].inertia, world.gravity, world.bodies[i].of.damping, left,
                    state.motion[i]);
      }
      return;
    }
    if (contacts.bounce(left, duration)) contacts.find(left);
    const double next = event < kMostEvents ? contacts.time_to_next(left) : left;
    // Impulses act on the velocities at the end of the step; bodies without impulses move freely.
    contacts.hold_apart(next, {});
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
      if (state.sleep[i].asleep) continue;
      const MovingBody& body = world.bodies[i];
      if (state.pushed[i]) {
        accelerate(world, body, next, state.motion[i]);
        contacts.add_impulses(i);
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

constexpr double kUnbounded = HUGE_VAL;

/// m/s; the least speed of separation at a contact: it may close its gap, and overlapping parts
/// separate slowly.
double least_speed_of(double gap, double step) {
  constexpr double kShare = 0.2, kFastest = 0.05;
  return gap >= 0 ? -gap / step : std::min(kShare * -gap / step, kFastest);
}

// m; the gap that the search aims at; any up to kMet is accepted.
constexpr double kSought = 0.5 * BodyContacts::kTouching;

/// s, until a freely growing depth reaches 0 from below; infinite if it does not.
double time_to_entry(double depth, double speed, double growth) {
  if (depth >= 0 && (speed > 0 || (speed == 0 && growth > 0) || depth > 0)) return 0;
  // depth + speed t + growth t^2 / 2 = 0, the first root after 0.
  const double under = speed * speed - 2 * growth * depth;
  if (under < 0) return HUGE_VAL;
  const double root = std::sqrt(under);
  if (speed > 0) return depth < 0 ? -2 * depth / (speed + root) : HUGE_VAL;
  if (growth > 0) return (root - speed) / growth;
  return HUGE_VAL;
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

SurfacePlace place_of(const CollisionSurface& surface, const Pose& frame) {
  return {&surface, glm::mat3_cast(frame.orientation), frame.position};
}

double kinetic_energy(const BodyWorld& world, const BodyWorldState& state) {
  double sum = 0;
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    sum += kinetic_energy(world.bodies[i].inertia, state.motion[i]);
  return sum;
}

Vec3 momentum(const BodyWorld& world, const BodyWorldState& state) {
  Vec3 sum(0);
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    sum += world.bodies[i].inertia.mass * state.motion[i].velocity;
  return sum;
}

Vec3 angular_momentum(const BodyWorld& world, const BodyWorldState& state) {
  Vec3 sum(0);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const BodyMotion& motion = state.motion[i];
    sum += motion.spin_momentum +
           world.bodies[i].inertia.mass * glm::cross(motion.centre, motion.velocity);
  }
  return sum;
}

void step_bodies(const BodyWorld& world, BodyWorldState& state, double duration) {
  if (state.sleeping == world.bodies.size()) return;
  move_all(world, state, duration);
  fall_asleep(world, state, duration);
}

void step_pressed(const BodyWorld& world, BodyWorldState& state, std::span<const char> chosen,
                  std::span<PressingSpring> springs, double duration) {
  BodyContacts contacts(world, state);
  double deepest = 0;  // no spring pushes farther
  for (const PressingSpring& spring : springs) deepest = std::max(deepest, spring.depth);
  contacts.find(duration, deepest, chosen);
  contacts.hold_apart(duration, springs);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    if (!chosen[i]) continue;
    accelerate(world, world.bodies[i], duration, state.motion[i]);
    contacts.add_impulses(i);
    move_pushed(world.bodies[i], duration, state.motion[i]);
  }
}

bool mark_connected(const BodyWorld& world, BodyWorldState& state, double duration, double distance,
                    std::span<char> marked) {
  BodyContacts contacts(world, state);
  contacts.find_near(duration, distance);
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
  return !BodyContacts(world, state).may_touch(body, duration, distance);
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

// The impulses in contacts.

void BodyContacts::begin_rows() {
  state_.rows.clear();
  state_.problem.clear();
}

void BodyContacts::add_row(std::uint32_t a, std::uint32_t b, const Vec3& place,
                           const Vec3& direction, double least_speed, double bound, int leader,
                           int spring) {
  if (state_.problem.full()) {
    state_.dropped = true;
    return;
  }
  Row row;
  row.a = a;
  row.b = b;
  row.direction = direction;
  row.spring = spring;
  double speed = 0;
  if (a != BodyContact::kStands) {
    row.moment_a = glm::cross(place - state_.motion[a].centre, direction);
    row.turn_a = state_.per_inertia[a] * row.moment_a;
    speed -= glm::dot(direction, state_.velocity[a]) + glm::dot(row.moment_a, state_.spin[a]);
  }
  if (b != BodyContact::kStands) {
    row.moment_b = glm::cross(place - state_.motion[b].centre, direction);
    row.turn_b = state_.per_inertia[b] * row.moment_b;
    speed += glm::dot(direction, state_.velocity[b]) + glm::dot(row.moment_b, state_.spin[b]);
  }
  row.speed = speed;
  state_.problem.add_row(least_speed - speed, bound, leader);
  state_.rows.push_back(row);
}

void BodyContacts::add_friction(const BodyContact& contact, int leader, double friction) {
  if (!(friction > 0) || leader < 0) return;
  Vec3 sliding(0);
  for (const auto& [body, sign] : {std::pair{contact.a, -1.0}, std::pair{contact.b, 1.0}}) {
    if (body == BodyContact::kStands) continue;
    sliding += sign * (state_.velocity[body] +
                       glm::cross(state_.spin[body], contact.place - state_.motion[body].centre));
  }
  sliding -= glm::dot(sliding, contact.normal) * contact.normal;
  // One direction is that of sliding: there the box of bounds equals the cone.
  const Vec3& n = contact.normal;
  Vec3 first = sliding;
  if (!(glm::dot(sliding, sliding) > 1e-20))
    first = glm::cross(n, std::abs(n.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0));
  first = glm::normalize(first);
  for (const Vec3& direction : {first, glm::cross(n, first)})
    add_row(contact.a, contact.b, contact.place, direction, 0, friction, leader, -1);
}

void BodyContacts::solve_rows(std::span<PressingSpring> springs, double step) {
  ComplementarityProblem& problem = state_.problem;
  if (problem.size() == 0) return;
  const auto coupling = [this](const Row& row, std::uint32_t body, const Row& other) {
    if (body == BodyContact::kStands) return 0.0;
    double sum = 0;
    const double per_mass = world_.bodies[body].inertia.per_mass;
    const Vec3& turn = row.a == body ? row.turn_a : row.turn_b;
    if (other.a == body)
      sum -= per_mass * glm::dot(row.direction, other.direction) + glm::dot(turn, other.moment_a);
    if (other.b == body)
      sum += per_mass * glm::dot(row.direction, other.direction) + glm::dot(turn, other.moment_b);
    return sum;
  };
  const auto compliance = [&](int i) {
    const PressingSpring& s = springs[static_cast<std::size_t>(i)];
    return 1 / (step * (step * s.stiffness + s.damping));
  };
  for (std::size_t i = 0; i < problem.size(); ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      const Row &row = state_.rows[i], &other = state_.rows[k];
      double sum = coupling(row, row.b, other) - coupling(row, row.a, other);
      if (row.spring >= 0 && other.spring >= 0) {
        const PressingSpring& s = springs[static_cast<std::size_t>(row.spring)];
        const PressingSpring& t = springs[static_cast<std::size_t>(other.spring)];
        if (i == k)
          sum += compliance(row.spring);
        else if (s.body == t.body && s.group == t.group)
          sum += glm::dot(s.normal, t.normal) *
                 std::sqrt(compliance(row.spring) * compliance(other.spring));
      }
      problem.a(i, k) = problem.a(k, i) = sum;
    }
  }
  if (!problem.solve()) ++state_.not_converged;
}

/// Whether the impulses of a bounce add energy above rounding: half the sum of impulses times the
/// speeds before and after.
bool BodyContacts::makes_energy() const {
  const ComplementarityProblem& problem = state_.problem;
  double sum = 0, scale = 0;
  for (std::size_t i = 0; i < problem.size(); ++i) {
    const double x = problem.x()[i];
    if (x == 0) continue;
    double change = 0;
    for (std::size_t k = 0; k < problem.size(); ++k) change += problem.a(i, k) * problem.x()[k];
    sum += x * (state_.rows[i].speed + 0.5 * change);
    scale += std::abs(x * state_.rows[i].speed);
  }
  return sum > 1e-12 * scale;
}

/// Newton's restitution with Coulomb's friction can add energy where friction reverses the sliding
/// (Kane & Levinson 1985). In that case, less friction acts; without friction no energy is added.
void BodyContacts::solve_bounce() {
  constexpr int kMostShares = 4;
  constexpr std::size_t kMostRefinedRows = 240;  // in all rounds; with many contacts, refine less
  ComplementarityProblem& problem = state_.problem;
  const auto refine = [&] {
    double least = 0;
    for (const double x : problem.x()) least = std::max(least, 1e-10 * x);
    for (std::size_t rows = problem.size(); rows <= kMostRefinedRows && problem.refine() > least;)
      rows += problem.size();
  };
  solve_rows({}, 0);
  refine();
  for (int round = 0; round <= kMostShares && makes_energy(); ++round) {
    problem.scale_friction(round < kMostShares ? 0.5 : 0);
    if (!problem.solve()) ++state_.not_converged;
    refine();
  }
  apply_rows({});
}

void BodyContacts::apply_rows(std::span<PressingSpring> springs) {
  const ComplementarityProblem& problem = state_.problem;
  for (std::size_t i = 0; i < problem.size(); ++i) {
    const double x = problem.x()[i];
    if (x == 0) continue;
    const Row& row = state_.rows[i];
    if (row.spring >= 0) springs[static_cast<std::size_t>(row.spring)].impulse = x;
    if (row.a != BodyContact::kStands) {
      state_.push[row.a] -= x * row.direction;
      state_.twist[row.a] -= x * row.moment_a;
      state_.pushed[row.a] = 1;
    }
    if (row.b != BodyContact::kStands) {
      state_.push[row.b] += x * row.direction;
      state_.twist[row.b] += x * row.moment_b;
      state_.pushed[row.b] = 1;
    }
  }
}

void BodyContacts::add_impulses(std::size_t body) {
  state_.motion[body].velocity += world_.bodies[body].inertia.per_mass * state_.push[body];
  state_.motion[body].spin_momentum += state_.twist[body];
}

/// Impacts pass through a group of touching bodies one after another, as through a row of balls:
/// pairs that approach separate, then the pairs that approach because of that (Smith, Kaufman,
/// Vouga, Tamstorf & Grinspun 2012, Reflections on simultaneous impact).
bool BodyContacts::bounce(double left, double step) {
  constexpr int kMostRounds = 24;
  const double resting = resting_speed(left);
  bool bounced = false;
  for (int round = 0; round < kMostRounds; ++round) {
    set_velocities(0);
    std::fill(state_.push.begin(), state_.push.end(), Vec3(0));
    std::fill(state_.twist.begin(), state_.twist.end(), Vec3(0));
    std::fill(state_.pushed.begin(), state_.pushed.end(), 0);
    find_islands();
    bool any = false;
    for (std::uint32_t island = 0; island < state_.island.size(); ++island) {
      if (state_.island[island] != island) continue;
      begin_rows();
      for (const BodyContact& contact : state_.contacts) {
        if (state_.island[contact.a] != island || !state_.near_parts[contact.parts].touches)
          continue;
        const double speed = separation_speed(contact);
        if (speed > -resting || contact.gap > kTouching - kAtOnce * step * speed) continue;
        const BodyPair& pair = world_.pairs[contact.pair];
        const int leader = static_cast<int>(state_.problem.size());
        add_row(contact.a, contact.b, contact.place, contact.normal, -pair.restitution * speed,
                kUnbounded, -1, -1);
        add_friction(contact, leader, pair.friction);
      }
      any |= state_.problem.size() > 0;
      solve_bounce();
    }
    if (!any) break;
    bounced = true;
    for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
      if (state_.pushed[i]) add_impulses(i);
    }
  }
  return bounced;
}

void BodyContacts::hold_apart(double step, std::span<PressingSpring> springs) {
  std::fill(state_.push.begin(), state_.push.end(), Vec3(0));
  std::fill(state_.twist.begin(), state_.twist.end(), Vec3(0));
  std::fill(state_.pushed.begin(), state_.pushed.end(), 0);
  if (state_.contacts.empty() && springs.empty()) return;
  set_velocities(step);
  find_islands();
  for (std::uint32_t island = 0; island < state_.island.size(); ++island) {
    if (state_.island[island] != island) continue;
    bool closing = false;
    for (const BodyContact& contact : state_.contacts) {
      if (state_.island[contact.a] == island && !state_.near_parts[contact.parts].apart)
        closing |= separation_speed(contact) < least_speed_of(contact.gap, step);
    }
    begin_rows();
    for (std::size_t s = 0; s < springs.size(); ++s) {
      const PressingSpring& spring = springs[s];
      if (state_.island[spring.body] != island) continue;
      closing = true;
      const double yield = step * (step * spring.stiffness + spring.damping);
      add_row(
          BodyContact::kStands, spring.body, spring.place, -spring.normal,
          spring.free_speed +
              step * (spring.stiffness * spring.depth + spring.damping * spring.closing) / yield,
          kUnbounded, -1, static_cast<int>(s));
    }
    if (!closing) continue;
    for (const bool friction : {false, true}) {
      int row = static_cast<int>(
          std::count_if(springs.begin(), springs.end(),
                        [&](const PressingSpring& s) { return state_.island[s.body] == island; }));
      for (const BodyContact& contact : state_.contacts) {
        if (state_.island[contact.a] != island) continue;
        const int leader = row++;
        if (!friction) {
          add_row(contact.a, contact.b, contact.place, contact.normal,
                  least_speed_of(contact.gap, step), kUnbounded, -1, -1);
        } else if (contact.gap <= 1e-6) {
          add_friction(contact, leader, world_.pairs[contact.pair].friction);
        }
      }
    }
    solve_rows(springs, step);
    apply_rows(springs);
  }
}

// When bodies meet.

double BodyContacts::time_to_next(double most) {
  const double resting = resting_speed(most);
  double next = most;
  for (auto& parts : state_.near_parts) parts.apart = !parts.touches;
  // Parts that touch and separate, as after a bounce, may meet elsewhere. Parts that overlap by
  // more than they separate do not come free.
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

/// m/s, at most, of any point against any other by the turn of both.
double BodyContacts::turning_of(const BodyPair& pair) const {
  return glm::length(state_.spin[pair.a]) * world_.bodies[pair.a].radius +
         (pair.obstacle ? 0 : glm::length(state_.spin[pair.b]) * world_.bodies[pair.b].radius);
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
double BodyContacts::meeting_time(const BodyWorldState::NearParts& near, double most) {
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

SpringPass pass_spring(const SpringStart& start, double duration) {
  constexpr int kMostEvents = 64;
  const double rate = std::sqrt(start.stiffness / start.mass);  // rad/s
  const double rest = start.growth / (rate * rate);             // m, where force and growth balance
  double depth = start.depth, speed = start.speed, left = duration;
  bool met = false;
  for (int event = 0; event < kMostEvents && left > 0; ++event) {
    const double entry = std::min(time_to_entry(depth, speed, start.growth), left);
    depth += entry * (speed + 0.5 * entry * start.growth);
    speed += entry * start.growth;
    left -= entry;
    if (left <= 0) break;
    met = true;
    depth = std::max(depth, 0.0);
    // depth(t) = rest + amplitude sin(rate t + phase)
    const double amplitude = std::hypot(depth - rest, speed / rate);
    const double phase = std::atan2(depth - rest, speed / rate);
    double inside = left;
    bool leaves = false;
    if (amplitude > rest) {
      double exit = std::numbers::pi + std::asin(std::min(1.0, std::max(-1.0, rest / amplitude)));
      if (exit - 2 * std::numbers::pi >= phase) exit -= 2 * std::numbers::pi;
      leaves = (exit - phase) / rate < left;
      if (leaves) inside = (exit - phase) / rate;
    }
    const double sine = std::sin(rate * inside), cosine = std::cos(rate * inside);
    const double end_speed = speed * cosine - rate * (depth - rest) * sine;
    depth = leaves ? 0 : rest + (depth - rest) * cosine + speed / rate * sine;
    speed = leaves ? std::min(end_speed, 0.0) : end_speed;
    left -= inside;
    if (leaves && speed == 0) break;
  }
  SpringPass pass;
  pass.depth = depth;
  pass.speed = speed;
  if (!met) return pass;
  // The spring's push is the free depth less the real one.
  const double free_speed = start.speed + duration * start.growth;
  const double free_depth = start.depth + duration * (start.speed + 0.5 * duration * start.growth);
  pass.impulse = start.mass * (free_speed - speed);
  pass.double_impulse = start.mass * (free_depth - depth);
  return pass;
}

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
  for (const ManifoldPoint& point : state_.manifold.points())
    add_contact(index, point.place, state_.manifold.normal, point.gap);
}

/// \param normal  from a to b
void BodyContacts::add_contact(std::uint32_t index, const Vec3& place, const Vec3& normal,
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

const CollisionSurface& BodyContacts::surface_b(const BodyPair& pair) const {
  return pair.obstacle ? *world_.obstacles[pair.b].surface : *world_.bodies[pair.b].surface;
}

/// The same of two surfaces.
/// \param turn  rad, by which they may turn against each other
void BodyContacts::measure_surfaces(std::uint32_t index, double reach, double turn, bool places) {
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
