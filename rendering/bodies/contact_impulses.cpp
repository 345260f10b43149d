#include "rendering/bodies/contact_impulses.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "rendering/bodies/body_meetings.h"

namespace palpate::rendering {
namespace {

constexpr double kUnbounded = HUGE_VAL;

/// m/s; the least speed of separation at a contact: it may close its gap, and overlapping parts
/// separate slowly.
double least_speed_of(double gap, double step) {
  constexpr double kShare = 0.2, kFastest = 0.05;
  return gap >= 0 ? -gap / step : std::min(kShare * -gap / step, kFastest);
}

}  // namespace

void ContactImpulses::begin_rows() {
  state_.rows.clear();
  state_.problem.clear();
}

void ContactImpulses::add_row(std::uint32_t a, std::uint32_t b, const Vec3& place,
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

void ContactImpulses::add_friction(const BodyContact& contact, int leader, double friction) {
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

void ContactImpulses::solve_rows(std::span<PressingSpring> springs, double step) {
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
bool ContactImpulses::makes_energy() const {
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
void ContactImpulses::solve_bounce() {
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

void ContactImpulses::apply_rows(std::span<PressingSpring> springs) {
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

void ContactImpulses::add_impulses(std::size_t body) {
  state_.motion[body].velocity += world_.bodies[body].inertia.per_mass * state_.push[body];
  state_.motion[body].spin_momentum += state_.twist[body];
}

/// Impacts pass through a group of touching bodies one after another, as through a row of balls:
/// pairs that approach separate, then the pairs that approach because of that (Smith, Kaufman,
/// Vouga, Tamstorf & Grinspun 2012, Reflections on simultaneous impact).
bool ContactImpulses::bounce(double left, double step) {
  constexpr int kMostRounds = 24;
  const double resting = resting_speed(world_, left);
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
        const double speed = separation_speed(state_, contact);
        if (speed > -resting || contact.gap > BodyMeetings::kTouching - kAtOnce * step * speed)
          continue;
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

void ContactImpulses::hold_apart(double step, std::span<PressingSpring> springs) {
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
        closing |= separation_speed(state_, contact) < least_speed_of(contact.gap, step);
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

/// The velocities after a step without impulses; the present ones for a step of 0.
void ContactImpulses::set_velocities(double step) {
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
void ContactImpulses::find_islands() {
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

}  // namespace palpate::rendering
