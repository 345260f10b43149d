#include "rendering/bodies/body_contacts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_sleep.h"

namespace palpate::rendering {
namespace {

// m; parts that are so near touch. Above rounding, below what is seen or felt.
constexpr double kTouching = 1e-8;
constexpr double kMet = 0.5 * kTouching;
constexpr double kUnbounded = 1e300;

/// m/s; the least speed of separation that a contact asks for: it may close its gap, and what
/// overlaps comes apart slowly.
double least_speed_of(double gap, double step) {
  constexpr double kShare = 0.2, kFastest = 0.05;
  return gap >= 0 ? -gap / step : std::min(kShare * -gap / step, kFastest);
}

}  // namespace

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

/// What is awake wakes what it may touch, and all that sleeps with it.
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

void BodyContacts::look_for(double within, double extra, std::span<const char> chosen,
                            bool places) {
  state_.near.clear();
  state_.near_parts.clear();
  state_.contacts.clear();
  for (std::size_t i = 0; i < world_.bodies.size(); ++i)
    state_.spin[i] =
        state_.sleep[i].asleep ? Vec3(0) : spin_of(world_.bodies[i].inertia, state_.motion[i]);
  std::fill(state_.placed.begin(), state_.placed.end(), 0);
  const double fall = glm::length(world_.gravity) * within * within;
  for (std::uint32_t index = 0; index < world_.pairs.size(); ++index) {
    const BodyPair& pair = world_.pairs[index];
    if (state_.sleep[pair.a].asleep && (pair.obstacle || state_.sleep[pair.b].asleep)) continue;
    if (!chosen.empty() && !chosen[pair.a] && (pair.obstacle || !chosen[pair.b])) continue;
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
    if (glm::dot(apart, apart) > reach * reach) continue;
    state_.near.push_back(index);
    find_in_pair(index, within, extra + (pair.obstacle ? fall : 0), places);
  }
}

void BodyContacts::place_parts(std::uint32_t body) {
  if (state_.placed[body]) return;
  state_.placed[body] = 1;
  const Mat3 axes = glm::mat3_cast(state_.motion[body].orientation);
  Vec3* centre = &state_.part_centres[world_.first_part[body]];
  for (const CollidingPart& part : world_.bodies[body].parts)
    *centre++ = axes * part.centre + state_.motion[body].centre;
}

void BodyContacts::find_in_pair(std::uint32_t index, double within, double extra, bool places) {
  const BodyPair& pair = world_.pairs[index];
  const MovingBody& body_a = world_.bodies[pair.a];
  const Pose pose_a = pose_of(pair.a), pose_b = pose_of_other(pair);
  place_parts(pair.a);
  if (!pair.obstacle) place_parts(pair.b);
  const Vec3* const centres_a = &state_.part_centres[world_.first_part[pair.a]];
  const Vec3* const centres_b =
      pair.obstacle ? nullptr : &state_.part_centres[world_.first_part[pair.b]];
  const Vec3 velocity = pair.obstacle ? Vec3(0) : state_.motion[pair.b].velocity;
  const double turning =
      glm::length(state_.spin[pair.a]) * body_a.radius +
      (pair.obstacle ? 0 : glm::length(state_.spin[pair.b]) * world_.bodies[pair.b].radius);
  const double reach = 2 * kTouching + extra +
                       within * (glm::length(velocity - state_.motion[pair.a].velocity) + turning);
  for (std::uint32_t k = 0; k < pair.count; ++k) {
    const PartPair& parts = world_.part_pairs[pair.first + k];
    const CollidingPart &a = body_a.parts[parts.part_a], &b = part_b(pair, parts.part_b);
    const Vec3 apart =
        (pair.obstacle ? b.centre : centres_b[parts.part_b]) - centres_a[parts.part_a];
    const double near = a.mesh->radius() + b.mesh->radius() + reach;
    if (glm::dot(apart, apart) > near * near) continue;
    const ConvexPlace at_a = place_of(a, pose_a), at_b = place_of(b, pose_b);
    GapMemory& memory = state_.gaps[pair.first + k];
    const Gap gap = gap_between(at_a, at_b, reach, memory);
    if (gap.distance > reach) continue;
    state_.near_parts.push_back({index, pair.first + k, gap.distance});
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
}

double BodyContacts::time_to_next(double most) {
  const double resting = resting_speed(most);
  double next = most;
  for (auto& parts : state_.near_parts) parts.apart = parts.gap > kTouching;
  // What touches and parts again, as after a bounce, may meet elsewhere.
  for (const BodyContact& contact : state_.contacts) {
    auto& parts = state_.near_parts[contact.parts];
    if (contact.gap <= kTouching && separation_speed(contact) > resting) parts.apart = true;
  }
  for (auto& parts : state_.near_parts) {
    if (!parts.apart) continue;
    next = std::min(next,
                    parts.gap > kTouching ? meeting_time(parts, next) : meeting_again(parts, next));
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
    if (distance <= kTouching) return time;
    const double fall =
        pair.obstacle ? std::max(0.0, glm::dot(world_.gravity, gap.normal)) * (most - time) : 0;
    const double speed = glm::dot(gap.normal, closing) + turning + fall;
    if (!(speed * (most - time) > distance - kMet)) return most;
    time += (distance - kMet) / speed;
  }
  const TimeAndGap low{time, gap_after(near, time, memory, closing).distance};
  const TimeAndGap high{most, gap_after(near, most, memory, closing).distance};
  if (low.gap <= kTouching) return time;
  if (high.gap > kMet) return most;
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
  low.gap -= kMet;
  high.gap -= kMet;
  for (int round = 0; round < kMostRounds; ++round) {
    const double middle = (low.time * high.gap - high.time * low.gap) / (high.gap - low.gap);
    const double value = gap_after(near, middle, memory, closing).distance - kMet;
    if (std::abs(value) <= kMet) return middle;
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

void BodyContacts::find_islands(std::span<const PressingSpring> springs) {
  (void)springs;  // a spring holds one body
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
  // One direction is that of sliding: the box of bounds then is a cone's where it matters.
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

/// Whether the impulses of a bounce give the bodies energy, above rounding: half the sum of
/// impulses times the speeds before and after.
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

/// Newton's restitution with Coulomb's friction can make energy where friction turns the sliding
/// round (Kane & Levinson 1985). Then less friction acts; without any none is made.
void BodyContacts::solve_bounce() {
  constexpr int kMostShares = 4;
  constexpr std::size_t kMostRefinedRows = 240;  // in all rounds: of many contacts less is known
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

/// m/s; what approaches more slowly is not thrown back.
double BodyContacts::resting_speed(double step) const {
  return 2 * glm::length(world_.gravity) * step + 1e-9;
}

/// Impacts go through a group of touching bodies one after another, as through a row of balls:
/// those that approach part, then those that approach then (Smith, Kaufman, Vouga, Tamstorf &
/// Grinspun 2012, Reflections on simultaneous impact).
bool BodyContacts::bounce(double step) {
  constexpr int kMostRounds = 24;
  const double resting = resting_speed(step);
  bool bounced = false;
  for (int round = 0; round < kMostRounds; ++round) {
    set_velocities(0);
    std::fill(state_.push.begin(), state_.push.end(), Vec3(0));
    std::fill(state_.twist.begin(), state_.twist.end(), Vec3(0));
    std::fill(state_.pushed.begin(), state_.pushed.end(), 0);
    find_islands({});
    bool any = false;
    for (std::uint32_t island = 0; island < state_.island.size(); ++island) {
      if (state_.island[island] != island) continue;
      begin_rows();
      for (const BodyContact& contact : state_.contacts) {
        if (state_.island[contact.a] != island || contact.gap > kTouching) continue;
        const double speed = separation_speed(contact);
        if (speed > -resting) continue;
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

void BodyContacts::hold_apart(double step, std::span<PressingSpring> springs,
                              std::span<const char> chosen) {
  std::fill(state_.push.begin(), state_.push.end(), Vec3(0));
  std::fill(state_.twist.begin(), state_.twist.end(), Vec3(0));
  std::fill(state_.pushed.begin(), state_.pushed.end(), 0);
  if (state_.contacts.empty() && springs.empty()) return;
  set_velocities(step);
  find_islands(springs);
  for (std::uint32_t island = 0; island < state_.island.size(); ++island) {
    if (state_.island[island] != island || (!chosen.empty() && !chosen[island])) continue;
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

}  // namespace palpate::rendering
