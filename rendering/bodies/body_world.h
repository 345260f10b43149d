#pragma once
// Bodies that move and collide, without a probe: their constants and their state. World frame, SI
// units.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rendering/bodies/complementarity.h"
#include "rendering/bodies/convex_gap.h"
#include "rendering/bodies/rigid_motion.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// A convex part of a body, or one that stands still.
struct CollidingPart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  Pose pose;    ///< in the body's frame, whose origin is the centre of mass; of what stands still
                ///< in the world's
  Vec3 inside;  ///< mesh frame
  Vec3 centre;  ///< of the bounding sphere, in the frame of the pose
};

struct MovingBody {
  int object = 0;
  BodyInertia inertia;
  stimuli::Body of;
  std::vector<CollidingPart> parts;
  double radius = 0;  ///< m, about the centre of mass
  BodyMotion start;
  Pose placed;           ///< where the scene put the body's frame
  double stiffness = 0;  ///< N/m, of its surface; what passes limits is refused
};

/// What stands still: the parts of one object.
struct Obstacle {
  int object = 0;
  std::vector<CollidingPart> parts;
  Vec3 centre;
  double radius = 0;
};

/// Two parts that may touch.
struct PartPair {
  std::uint32_t part_a = 0, part_b = 0;
};

/// A body and another, or an obstacle.
struct BodyPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;  ///< index of the body, or of the obstacle
  bool obstacle = false;
  std::uint32_t first = 0, count = 0;  ///< of the part pairs
  double restitution = 0, friction = 0;
};

struct BodyWorld {
  std::vector<MovingBody> bodies;
  std::vector<Obstacle> obstacles;
  std::vector<BodyPair> pairs;
  std::vector<PartPair> part_pairs;
  std::vector<std::uint32_t> first_part;  ///< of each body, and one more: counts of parts before it
  Vec3 gravity{0, 0, 0};
  bool sleeps = true;  ///< bodies at rest are not moved

  /// Sets the pairs and first_part from bodies and obstacles.
  void pair_up();
};

/// A place where two bodies touch or soon will.
struct BodyContact {
  static constexpr std::uint32_t kStands = ~std::uint32_t{0};
  std::uint32_t a = 0, b = kStands;  ///< bodies
  std::uint32_t pair = 0;
  Vec3 place, normal;       ///< normal: unit, from a to b
  double gap = 0;           ///< m
  std::uint32_t parts = 0;  ///< index in BodyWorldState::near_parts
};

/// A spring that presses on a body within a step: the probe. It acts along -normal.
struct PressingSpring {
  std::uint32_t body = 0;
  int group = 0;          ///< springs of one ideal tool: their depths are of one translation
  Vec3 place, normal;     ///< normal: out of the body
  double depth = 0;       ///< m, at the end of the step, were there no spring
  double free_speed = 0;  ///< m/s, by which the body's place retreats without the spring
  double stiffness = 0;   ///< N/m
  double damping = 0;     ///< N s/m
  double closing = 0;     ///< m/s, by which the depth grows without the spring
  double impulse = 0;     ///< N s; the result
};

/// Whether a body sleeps, and since when it has gone nowhere.
struct SleepState {
  bool asleep = false;
  double rested = 0;        ///< s
  std::uint32_t group = 0;  ///< of those that fell asleep together
  Vec3 centre;              ///< m; where it was when it came to rest
  Quat orientation{1, 0, 0, 0};
};

/// Where two bodies were when the distances of their parts were looked at (GapMemory::least). As
/// long as they have moved by less, what was far apart is.
struct PairPlaces {
  Vec3 centre_a, centre_b;
  Quat orientation_a{1, 0, 0, 0}, orientation_b{1, 0, 0, 0};
  double least = -HUGE_VAL;  ///< m; no part of one was nearer to any of the other
};

/// What the step changes and the room it needs.
struct BodyWorldState {
  std::vector<BodyMotion> motion;
  std::vector<GapMemory> gaps;       ///< of each part pair
  std::vector<PairPlaces> measured;  ///< of each pair
  std::vector<SleepState> sleep;
  std::size_t sleeping = 0;         ///< bodies
  bool dropped = false;             ///< contacts or friction of them, since this was set to false
  std::uint64_t not_converged = 0;  ///< problems that met the limit of pivots

  // Room. Copies of a state have none until they make it.
  static constexpr std::size_t kMostContacts = 512;
  std::size_t most_pairs = 0, most_parts = 0, most_corners = 0;
  void make_room();
  std::vector<std::uint32_t> near;  ///< pairs
  std::vector<Vec3> part_centres;   ///< of each part of each body, where `placed` says so, world
  std::vector<char> placed;         ///< of each body
  struct NearParts {
    std::uint32_t pair = 0, parts = 0;
    double gap = 0;
    bool touches = false;  ///< gap at most BodyContacts::kTouching
    bool apart = false;    ///< moving freely, they do not meet before the next event
  };
  std::vector<NearParts> near_parts;
  std::vector<BodyContact> contacts;
  std::vector<std::uint32_t> island;  ///< of each body, by its first body
  std::vector<Vec3> velocity, spin;   ///< of each body, as it would be without impulses
  std::vector<Vec3> push, twist;      ///< N s, N m s; impulses on each body
  std::vector<Mat3> per_inertia;
  std::vector<char> pushed;
  ClipRoom clip;
  Manifold manifold;
  ComplementarityProblem problem;
  struct Row {
    std::uint32_t a = BodyContact::kStands, b = BodyContact::kStands;
    Vec3 direction;           ///< impulse on b along it, on a against it
    Vec3 moment_a, moment_b;  ///< m, of a unit impulse
    Vec3 turn_a, turn_b;      ///< rad/s, by it
    int spring = -1;          ///< index of the spring that presses here
    double speed = 0;         ///< m/s, without impulses, by which a and b separate along it
  };
  std::vector<Row> rows;
};

BodyWorldState initial_state(const BodyWorld& world);

/// Where a part is now.
ConvexPlace place_of(const CollidingPart& part, const Pose& frame);

/// kg m^2/s^2 and the like are left out: momentum and energy of all bodies.
double kinetic_energy(const BodyWorld& world, const BodyWorldState& state);
Vec3 momentum(const BodyWorld& world, const BodyWorldState& state);
Vec3 angular_momentum(const BodyWorld& world, const BodyWorldState& state);  ///< about the origin

// A step of bodies that collide. Free motion goes up to the time at which a pair meets; there the
// bodies bounce, and the step goes on. What touches or may meet within the rest of the step is held
// apart by impulses that solve a linear complementarity problem. Nothing here allocates.

/// Moves all bodies on. \param duration  s
void step_bodies(const BodyWorld& world, BodyWorldState& state, double duration);

/// Moves those bodies on that springs press on, and what they touch, in one go, so that a body
/// between a spring and a wall is held. They start where `state` has them; springs get their
/// impulses.
/// \param chosen  1 for each body that is to move
void step_pressed(const BodyWorld& world, BodyWorldState& state, std::span<const char> chosen,
                  std::span<PressingSpring> springs, double duration);

/// Marks all that is connected with a marked body through what touches, or may meet within a step
/// in which bodies are pushed by a distance besides, m.
/// \return whether a marked body has anything to touch
bool mark_connected(const BodyWorld& world, BodyWorldState& state, double duration, double distance,
                    std::span<char> marked);

/// Whether a body that is awake touches nothing, nor may within a step in which it goes so much
/// farther, m. Wakes nothing.
bool touches_nothing(const BodyWorld& world, BodyWorldState& state, std::uint32_t body,
                     double duration, double distance);

// Bodies that have come to rest sleep: they are neither moved nor held against each other until
// something comes near. Nothing here allocates.

/// After a step: those that touch each other fall asleep together when each has gone nowhere for
/// half a second. Where neither gravity nor damping acts, a body sleeps only if it has no momentum
/// at all, so that none is lost.
/// \param duration  s, of the step
void fall_asleep(const BodyWorld& world, BodyWorldState& state, double duration);

/// Wakes a body and those that fell asleep with it.
void wake(BodyWorldState& state, std::uint32_t body);

// A mass against a one-sided spring for the length of a tick, in closed form: the spring is entered
// and left at their times within the tick, so that energy is neither made nor lost. A force that is
// held over a tick makes energy (1 g at 1 kN/m leaves with 2.1 times its speed), an implicit one
// loses it.

/// A depth that would grow freely.
struct SpringStart {
  double depth = 0;      ///< m, at the beginning; negative before the spring is met
  double speed = 0;      ///< m/s, by which it grows
  double growth = 0;     ///< m/s^2, constant
  double mass = 1;       ///< kg, effective at the place of contact
  double stiffness = 1;  ///< N/m
};

/// What the spring did.
struct SpringPass {
  double impulse = 0;         ///< N s, integral of the force
  double double_impulse = 0;  ///< kg m, integral of the impulse so far: moves mass by 1/mass of it
  double depth = 0;           ///< m, at the end
  double speed = 0;           ///< m/s, at the end
};

/// \param duration  s
SpringPass pass_spring(const SpringStart& start, double duration);

}  // namespace palpate::rendering
