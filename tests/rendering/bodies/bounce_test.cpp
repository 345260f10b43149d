// Bounces off the middle, against Newton's law of restitution with Coulomb's friction in closed
// form.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "data/base/random.h"
#include "rendering/bodies/body_world.h"
#include "rendering/bodies/one_sided_spring.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {

constexpr Quat kAsItIs{1, 0, 0, 0};

double drawn(Random& random, double low, double high) { return low + (high - low) * random.unit(); }

Quat turned_anyhow(Random& random) {
  return glm::normalize(
      Quat(drawn(random, -1, 1), drawn(random, -1, 1), drawn(random, -1, 1), drawn(random, -1, 1)));
}

double energy_of(const Scene& scene, const RenderState& state) {
  return kinetic_energy(body_world_of(scene), body_state_of(state));
}

/// A body that strikes a plane with one of its points; all in the plane z = 0, with normal and
/// tangent as axes.
struct PlanarImpact {
  double mass = 1, moment = 1;     ///< kg, kg m^2
  double normal = 0, tangent = 0;  ///< m, from the centre to the point
  double restitution = 1, friction = 0;
};

struct PlanarMotion {
  double normal = 0, tangent = 0, spin = 0;  ///< m/s, rad/s
};

/// Newton's law: the speed of approach returns, multiplied by the restitution; friction holds the
/// point if its cone allows, else it slides.
PlanarMotion after_impact(const PlanarImpact& of, const PlanarMotion& before) {
  // At the point: u_n = v_n - w r_t, u_t = v_t + w r_n.
  const double rn = of.normal, rt = of.tangent;
  const double nn = 1 / of.mass + rt * rt / of.moment, tt = 1 / of.mass + rn * rn / of.moment;
  const double nt = -rt * rn / of.moment;
  const double un = before.normal - before.spin * rt, ut = before.tangent + before.spin * rn;
  const double wanted = -(1 + of.restitution) * un;
  const double determinant = nn * tt - nt * nt;
  double jn = (wanted * tt + ut * nt) / determinant;
  double jt = (-ut * nn - wanted * nt) / determinant;
  if (std::abs(jt) > of.friction * jn) {
    const double sign = jt > 0 ? 1 : -1;
    jn = wanted / (nn + sign * of.friction * nt);
    jt = sign * of.friction * jn;
  }
  return {before.normal + jn / of.mass, before.tangent + jt / of.mass,
          before.spin + (rn * jt - rt * jn) / of.moment};
}

/// A tilted plank falls on an edge, with the edge's whole length on the floor.
TEST(Bounce, PlankOnEdgeFollowsNewtonAndCoulomb) {
  const double length = 0.2, height = 0.04, depth = 0.06, mass = 0.3;
  const double moment = mass / 12 * (length * length + height * height);
  for (const double friction : {0.0, 0.1, 0.4, 2.0}) {
    for (const double restitution : {1.0, 0.6, 0.2}) {
      for (const double angle : {-0.9, -0.3, 0.4, 0.8}) {
        for (const double sliding : {-0.7, 0.0, 0.2}) {
          BodyScene s;
          s.stands(box_mesh({3, 0.1, 3}), {{0, -0.05, 0}, kAsItIs});
          const Quat turn = glm::angleAxis(angle, Vec3(0, 0, 1));
          // The lowest edge.
          const Vec3 corner =
              turn * Vec3(angle > 0 ? -0.5 * length : 0.5 * length, -0.5 * height, 0);
          stimuli::Body& body =
              s.moves(box_mesh({length, height, depth}), {{0, 0.0499 - corner.y, 0}, turn}, mass);
          body.velocity = {sliding, -1, 0};
          body.restitution = restitution;
          body.friction = friction;
          const Scene scene = s.scene();
          RenderState state = scene.initial_state();
          const PlanarMotion expected = after_impact(
              {mass, moment, corner.y, -corner.x, restitution, friction}, {-1, -sliding, 0});
          run(scene, state, 0.05);
          const BodyPose& now = state.motion.bodies()[0];
          const double after =
              0.5 * mass *
                  (expected.normal * expected.normal + expected.tangent * expected.tangent) +
              0.5 * moment * expected.spin * expected.spin;
          // Where the law itself would add energy, less friction acts.
          if (after > 0.5 * mass * (1 + sliding * sliding) * (1 + 1e-9)) continue;
          EXPECT_NEAR(now.velocity.y, expected.normal, 1e-6)
              << friction << " " << restitution << " " << angle << " " << sliding;
          EXPECT_NEAR(now.velocity.x, -expected.tangent, 1e-6);
          EXPECT_NEAR(now.spin.z, expected.spin, 1e-5);
          EXPECT_NEAR(std::abs(now.spin.x) + std::abs(now.velocity.z), 0, 1e-6);
        }
      }
    }
  }
}

/// Turning boxes meet a wall with one corner after another; each impact keeps the energy.
void expect_energy_stays(std::uint64_t seed) {
  Random random(seed);
  for (int trial = 0; trial < 40; ++trial) {
    BodyScene s;
    s.stands(box_mesh({0.1, 2, 2}), {{0.2, 0, 0}, kAsItIs});
    // Almost flat boxes meet it with the far edge some tenths of a millisecond after the near one.
    const Quat turn = trial % 2 == 0 ? turned_anyhow(random)
                                     : glm::angleAxis(drawn(random, -2e-3, 2e-3), Vec3(0, 0, 1));
    stimuli::Body& body = s.moves(box_mesh({0.05, 0.2, 0.08}), {{0, 0, 0}, turn}, 0.3);
    body.restitution = 1;
    body.friction = 0;
    body.velocity = {1, 0.2, 0};
    if (trial % 4 > 1) body.spin = {drawn(random, -5, 5), drawn(random, -5, 5), 2};
    if (trial % 3 == 0) {
      stimuli::Body& other =
          s.moves(box_mesh({0.1, 0.05, 0.08}), {{0.05, 0.3, 0.01}, turned_anyhow(random)},
                  trial % 2 ? 0.3 : 5);
      other.restitution = 1;
      other.friction = 0;
      other.velocity = {0.1, -2, 0.3};
    }
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const double before = energy_of(scene, state);
    const Vec3 came = state.motion.bodies()[0].velocity;
    run(scene, state, 0.5);
    EXPECT_NEAR(energy_of(scene, state) / before, 1, 1e-8) << seed << " " << trial;
    EXPECT_GT(glm::distance(state.motion.bodies()[0].velocity, came), 0.1) << seed << " " << trial;
  }
}

/// Seeds 126 to 147 once had a meeting that rounding put too far away to bounce, or two corners
/// that met within a microsecond, one of them only held. With seed 1522 a box driven against the
/// wall by another bounces nine times in one tick; with 1941 two corners meet 13 ns before the
/// tick's end.
TEST(Bounce, ElasticFrictionlessBouncesKeepEnergy) {
  for (const std::uint64_t seed : {5, 126, 142, 146, 147, 1522, 1941}) expect_energy_stays(seed);
}

/// Friction reverses sliding where a body strikes with its mass behind the point: Newton's law
/// would add energy there.
TEST(Bounce, FrictionAddsNoEnergy) {
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  int struck = 0;
  for (int trial = 0; trial < 200; ++trial) {
    BodyScene s;
    s.stands(box_mesh({0.1, 3, 3}), {{0.2, 0, 0}, kAsItIs});
    stimuli::Body& body =
        s.moves(box_mesh({0.3, 0.02, 0.02}), {{-0.05, 0, 0}, turned_anyhow(random)}, 0.3);
    body.restitution = trial % 2 == 0 ? 1 : 0.7;
    body.friction = drawn(random, 0.1, 3);
    body.velocity = {1, drawn(random, -3, 3), drawn(random, -3, 3)};
    body.spin = {drawn(random, -20, 20), drawn(random, -20, 20), drawn(random, -20, 20)};
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const double before = energy_of(scene, state);
    run(scene, state, 0.3);
    EXPECT_LE(energy_of(scene, state), before * (1 + 1e-8)) << trial;
    struck += state.motion.bodies()[0].velocity.x < 0.9 ? 1 : 0;
  }
  EXPECT_GT(struck, 150);
}

struct TipBounce {
  double mass, stiffness, off;
  Vec3 spin{0, 0, 0};
  Vec3 hand{0, 0, 0};  ///< m/s
  double speed = 0.3;  ///< m/s, of the body
};

struct TipResult {
  double energy_before = 0, energy_after = 0, work = 0;  ///< J; work of the hand on the body
  Vec3 velocity{0, 0, 0}, spin{0, 0, 0};
  Vec3 momentum_given{0, 0, 0};  ///< N s, by the hand
  int ticks_in_contact = 0;
};

/// A box flies off-centre against the tip, until it has left.
TipResult bounce_on_tip(const TipBounce& of, double dt) {
  BodyScene s;
  s.stiffness = of.stiffness;
  stimuli::Body& body = s.moves(box_mesh({0.05, 0.1, 0.06}), {{-0.05, 0, 0}, kAsItIs}, of.mass);
  body.velocity = {of.speed, 0, 0};
  body.spin = of.spin;
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  TipResult result;
  result.energy_before = energy_of(scene, state);
  const auto probe = [&](int tick) {
    const Vec3 tip = Vec3(0, of.off, 0.005) + tick * dt * of.hand;
    return LineProbe{tip, tip + Vec3(0.12, 0, 0)};
  };
  ray_renderer().tick(scene, state, probe(0), 0);
  int away = 0;
  for (int i = 1; i < 3.0 / dt && away * dt < 0.01; ++i) {
    const Rendering r = ray_renderer().tick(scene, state, probe(i), dt);
    // The force on the hand is constant over a tick, and the hand moves evenly within it.
    result.work -= dt * glm::dot(r.force, of.hand);
    result.momentum_given -= dt * r.force;
    result.ticks_in_contact += r.contacts > 0 ? 1 : 0;
    away = r.contacts > 0 || result.ticks_in_contact == 0 ? 0 : away + 1;
    if (of.speed < 1) {  // a fast one turns over onto its side
      EXPECT_GE(r.force.x, -1e-12);
    }
  }
  const BodyPose& now = state.motion.bodies()[0];
  result.energy_after = energy_of(scene, state);
  result.velocity = now.velocity;
  result.spin = now.spin;
  return result;
}

TEST(Bounce, TipBounceOffCentreKeepsEnergy) {
  for (const double mass : {1e-3, 0.1, 10.0}) {
    for (const double stiffness : {200.0, 3000.0, 5e4}) {
      if (mass > 1 && stiffness < 1000) continue;  // it would go through the box
      for (const double off : {0.0, 0.02, 0.04}) {
        for (const Vec3& spin : {Vec3(0), Vec3(0.3, 1, 0.2)}) {
          const TipResult r = bounce_on_tip({mass, stiffness, off, spin}, 1e-3);
          EXPECT_GT(r.ticks_in_contact, 0);
          EXPECT_NEAR(r.energy_after / r.energy_before, 1, 1e-9)
              << mass << " " << stiffness << " " << off << " " << spin.y;
        }
      }
    }
  }
}

/// The tip passes through much of a light body, which turns far within a millisecond.
TEST(Bounce, FastBodyGivesTipMomentumGainingNoEnergy) {
  for (const double mass : {1e-3, 0.03, 1.0}) {
    for (const double stiffness : {3e3, 1e4, 5e4}) {
      for (const double speed : {1.0, 3.0, 10.0}) {
        for (const double off : {0.0, 0.02, 0.03, 0.04}) {
          for (const Vec3& spin : {Vec3(0), Vec3(-20, 5, 50)}) {
            for (const Vec3& hand : {Vec3(0), Vec3(-2, 0, 0)}) {
              const TipResult r = bounce_on_tip({mass, stiffness, off, spin, hand, speed}, 1e-3);
              EXPECT_GT(r.ticks_in_contact, 0);
              EXPECT_LE(r.energy_after - r.work, 1.02 * std::max(r.energy_before, r.work))
                  << mass << " " << stiffness << " " << speed << " " << off << " " << spin.x << " "
                  << hand.x;
              const Vec3 gained = mass * (r.velocity - Vec3(speed, 0, 0));
              EXPECT_NEAR(glm::distance(gained, r.momentum_given) / (mass * speed), 0, 1e-9);
            }
          }
        }
      }
    }
  }
}

/// A still stylus comes between the balls of a turning dumbbell. When both meet it, from opposite
/// sides, the ideal stylus is centimetres away although nobody has pressed it so far.
TEST(Bounce, DumbbellsTurningOnAStylusGainLittleEnergy) {
  constexpr std::uint64_t kSeed = 105;
  Random random(kSeed);
  const Mesh ball = mesh_of(stimuli::icosphere(0.02, 3));
  const Mesh bar = mesh_of(stimuli::cylinder(0.008, 0.06, 24));
  int touched = 0;
  for (int trial = 0; trial < 200; ++trial) {
    BodyScene s;
    s.stiffness = std::pow(10, drawn(random, 3, 4.7));
    stimuli::Body& body =
        s.moves({{ball, {{0, 0, 0.03}, kAsItIs}}, {ball, {{0, 0, -0.03}, kAsItIs}}, {bar, {}}},
                {{-0.08, 0, 0}, turned_anyhow(random)}, std::pow(10, drawn(random, -3, 0)));
    const double speed = drawn(random, 0.3, 3), spin = 20 * speed;
    body.velocity = {speed, 0, 0};
    body.spin = {drawn(random, -spin, spin), drawn(random, -spin, spin),
                 drawn(random, -spin, spin)};
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const Vec3 tip(-0.01, drawn(random, -0.03, 0.03), drawn(random, -0.03, 0.03));
    const Vec3 along(drawn(random, 0, 1), drawn(random, -1, 1), drawn(random, -1, 1));
    const LineProbe probe{tip, tip + 0.12 * glm::normalize(along)};
    const double before = energy_of(scene, state);
    double most = 0;
    bool touches = false;
    for (int i = 0; i < 200; ++i) {
      touches |= ray_renderer().tick(scene, state, probe, i == 0 ? 0 : 1e-3).contacts > 0;
      most = std::max(most, energy_of(scene, state));
    }
    EXPECT_LE(most, 1.3 * before) << trial;  // found: up to 1.25, where it jams the stylus
    touched += touches ? 1 : 0;
  }
  EXPECT_GT(touched, 80);
}

/// A body on a wall does not fly off: at any speed, the hand gets the force of its present place,
/// not the mean over the tick, which would be half a tick late and not passive.
TEST(Bounce, BodyOnWallPushesFromItsPresentPlace) {
  BodyScene s;
  s.stiffness = 1000;
  s.stands(box_mesh({0.1, 1, 1}), {{-0.05, 0, 0}, kAsItIs});
  s.moves(box_mesh(Vec3(0.02)), {{0.01, 0, 0}, kAsItIs}, 0.01);
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  for (int i = 0; i < 40; ++i) {
    const double depth = 5e-3 * std::sin(0.3 * i);  // m; at 1.5 m/s
    const LineProbe probe{{0.02 - depth, 0, 0}, {0.14 - depth, 0, 0}};
    const Rendering r = ray_renderer().tick(scene, state, probe, i == 0 ? 0 : 1e-3);
    if (i > 1) {
      EXPECT_NEAR(r.force.x, 1000 * std::max(0.0, depth), 1e-3) << i;
    }
  }
}

/// A body has afterwards the energy that the approaching hand gave it.
TEST(Bounce, BodyOnMovingTipGainsTheHandsWork) {
  for (const double mass : {1e-3, 0.1}) {
    for (const double stiffness : {1000.0, 5e4}) {
      const TipResult r = bounce_on_tip({mass, stiffness, 0.03, Vec3(0), {-0.2, 0, 0}}, 1e-3);
      EXPECT_GT(r.work, 0.2 * r.energy_before);
      EXPECT_NEAR((r.energy_after - r.work) / r.energy_before, 1, 1e-8) << mass << " " << stiffness;
    }
  }
}

/// Compares the motion, not only the energy: steps of a millisecond against steps of ten
/// microseconds.
TEST(Bounce, TipBounceOffCentreMatchesFineSteps) {
  for (const double off : {0.01, 0.04}) {
    const TipBounce of{0.1, 3000, off, Vec3(0.3, 1, 0.2)};
    const TipResult coarse = bounce_on_tip(of, 1e-3), fine = bounce_on_tip(of, 1e-5);
    EXPECT_NEAR(glm::distance(coarse.velocity, fine.velocity) / 0.3, 0, 2e-3) << off;
    EXPECT_NEAR(glm::distance(coarse.spin, fine.spin) / glm::length(fine.spin), 0, 2e-3) << off;
  }
}

/// A body almost out of a spring while something pushes it in: the spring's rest is deeper.
TEST(Bounce, ASpringIsLeftFromAboveItsRest) {
  const SpringStart start{5e-5, -0.29, 0.77, 10, 5e4};
  double depth = start.depth, speed = start.speed, impulse = 0;
  const int steps = 1000000;
  const double duration = 1e-3, h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    const double force = depth > 0 ? start.stiffness * depth : 0;
    speed += h * (start.growth - force / start.mass);
    depth += h * speed;
    impulse += h * force;
  }
  const SpringPass pass = pass_spring(start, duration);
  EXPECT_GT(pass.impulse, 0);
  EXPECT_NEAR(pass.impulse, impulse, 1e-3 * impulse);
  EXPECT_NEAR(pass.depth, depth, 1e-8);
}

}  // namespace
}  // namespace palpate::rendering::test
