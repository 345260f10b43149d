#pragma once
// Bodies that move and collide, without a probe: their constants, their state and its steps. World
// frame, SI units. No step allocates.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rendering/bodies/complementarity.h"
#include "rendering/bodies/convex_gap.h"
#include "rendering/bodies/rigid_motion.h"
#include "rendering/bodies/surface_gap.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// A convex part of a body or of an obstacle.
struct CollidingPart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  Pose pose;    ///< in the body's frame, whose origin is the centre of mass; of an obstacle in the
                ///< world's
  Vec3 inside;  ///< mesh frame
  Vec3 centre;  ///< of the bounding sphere, in the frame of the pose
};

struct MovingBody {
  int object = 0;
  BodyInertia inertia;
  stimuli::Body of;
  std::vector<CollidingPart> parts;  ///< empty: neither convex nor made of convex parts
  /// In its frame; null: it meets only bodies and obstacles that have parts.
  std::shared_ptr<const stimuli::CollisionSurface> surface;
  double radius = 0;  ///< m, about the centre of mass
  BodyMotion start;
  Pose placed;           ///< where the scene put the body's frame
  double stiffness = 0;  ///< N/m, of its surface
};

/// One object that stands still.
struct Obstacle {
  int object = 0;
  std::vector<CollidingPart> parts;                          ///< as of MovingBody
  std::shared_ptr<const stimuli::CollisionSurface> surface;  ///< in the world's frame
  Vec3 centre;
  double radius = 0;
};

/// Two parts that may touch. A pair of surfaces has one without meaning.
struct PartPair {
  std::uint32_t part_a = 0, part_b = 0;
};

/// A body and another, or an obstacle.
struct BodyPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;  ///< index of the body, or of the obstacle
  bool obstacle = false;
  bool by_surface = false;             ///< meets by surfaces, not by convex parts
  std::uint32_t first = 0, count = 0;  ///< of the part pairs
  double restitution = 0, friction = 0;
};

struct BodyWorld {
  std::vector<MovingBody> bodies;
  std::vector<Obstacle> obstacles;
  std::vector<BodyPair> pairs;
  std::vector<PartPair> part_pairs;
  std::vector<std::uint32_t> first_part;  ///< of each body, plus one: number of parts before it
  Vec3 gravity{0, 0, 0};
  bool sleeps = true;  ///< bodies at rest are not moved

  /// Sets the pairs and first_part from bodies and obstacles.
  void pair_up();
};

/// A place where two bodies touch or soon will touch.
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
  int group = 0;          ///< springs of one ideal tool: one translation gives their depths
  Vec3 place, normal;     ///< normal: out of the body
  double depth = 0;       ///< m, at the end of the step if there were no spring
  double free_speed = 0;  ///< m/s, by which the body's place retreats without the spring
  double stiffness = 0;   ///< N/m
  double damping = 0;     ///< N s/m
  double closing = 0;     ///< m/s, by which the depth grows without the spring
  double impulse = 0;     ///< N s; the result
};

/// Whether a body sleeps, and for how long it has been at rest.
struct SleepState {
  bool asleep = false;
  double rested = 0;        ///< s
  std::uint32_t group = 0;  ///< shared by bodies that fell asleep together
  Vec3 centre;              ///< m; where it was when it came to rest
  Quat orientation{1, 0, 0, 0};
};

/// Where two bodies were when the distances of their parts were measured (GapMemory::least). Parts
/// farther apart than the bodies have moved since need no new measurement.
struct PairPlaces {
  Vec3 centre_a, centre_b;
  Quat orientation_a{1, 0, 0, 0}, orientation_b{1, 0, 0, 0};
  double least = -HUGE_VAL;  ///< m; their parts were at least this far apart
};

/// The state that a step changes and its working memory.
struct BodyWorldState {
  std::vector<BodyMotion> motion;
  std::vector<GapMemory> gaps;       ///< of each part pair
  std::vector<PairPlaces> measured;  ///< of each pair
  std::vector<SleepState> sleep;
  std::size_t sleeping = 0;         ///< bodies
  bool dropped = false;             ///< a contact or its friction was dropped since the last reset
  std::uint64_t not_converged = 0;  ///< problems that reached the limit of pivots

  // Working memory. Copies of a state have none until they allocate it.
  static constexpr std::size_t kMostContacts = 512;
  std::size_t most_pairs = 0, most_parts = 0, most_corners = 0;
  void make_room();
  std::vector<std::uint32_t> near;  ///< pairs
  std::vector<Vec3> part_centres;   ///< of each part of each body with `placed` set, world frame
  std::vector<char> placed;         ///< of each body
  struct NearParts {
    std::uint32_t pair = 0, parts = 0;
    double gap = 0;
    bool touches = false;  ///< gap at most BodyMeetings::kTouching
    /// In free motion they do not meet before the next event; false for parts that rest on each
    /// other.
    bool apart = false;
  };
  std::vector<NearParts> near_parts;
  std::vector<BodyContact> contacts;
  std::vector<std::uint32_t> island;  ///< of each body, by its first body
  std::vector<Vec3> velocity, spin;   ///< of each body, without impulses
  std::vector<Vec3> push, twist;      ///< N s, N m s; impulses on each body
  std::vector<Mat3> per_inertia;
  std::vector<char> pushed;
  ClipRoom clip;
  Manifold manifold;
  bool has_surfaces = false;
  NearPlaces places;
  ComplementarityProblem problem;
  struct Row {
    std::uint32_t a = BodyContact::kStands, b = BodyContact::kStands;
    Vec3 direction;           ///< of the impulse on b; a gets the opposite
    Vec3 moment_a, moment_b;  ///< m, of a unit impulse
    Vec3 turn_a, turn_b;      ///< rad/s, of a unit impulse
    int spring = -1;          ///< index of the spring that presses here
    double speed = 0;         ///< m/s, at which a and b separate without impulses
  };
  std::vector<Row> rows;
};

BodyWorldState initial_state(const BodyWorld& world);

/// The present place of a part or surface.
ConvexPlace place_of(const CollidingPart& part, const Pose& frame);
SurfacePlace place_of(const stimuli::CollisionSurface& surface, const Pose& frame);

/// Moves all bodies. They move freely until a pair meets; there they bounce, and the step
/// continues. Bodies that touch or may meet within the rest of the step are held apart by impulses
/// that solve a linear complementarity problem.
/// \param duration  s
void step_bodies(const BodyWorld& world, BodyWorldState& state, double duration);

/// Moves bodies that springs press on, together with those that they touch, so that a body between
/// a spring and a wall is held. They start from `state`; sets the springs' impulses.
/// \param chosen  1 for each body to move
void step_pressed(const BodyWorld& world, BodyWorldState& state, std::span<const char> chosen,
                  std::span<PressingSpring> springs, double duration);

/// Marks all bodies connected with a marked one through contacts, present or possible within a
/// step.
/// \param distance  m, by which bodies may be pushed in addition
/// \return whether a marked body may touch anything
bool mark_connected(const BodyWorld& world, BodyWorldState& state, double duration, double distance,
                    std::span<char> marked);

/// Whether an awake body touches nothing and cannot within a step. Wakes nothing.
/// \param distance  m, by which it may be pushed in addition
bool touches_nothing(const BodyWorld& world, BodyWorldState& state, std::uint32_t body,
                     double duration, double distance);

/// Call after a step. Bodies that have come to rest sleep: they are neither moved nor held against
/// each other until something comes near. Bodies that touch each other fall asleep together once
/// each has been at rest for half a second. Without gravity and damping, a body sleeps only with
/// zero momentum, so that no momentum is lost.
/// \param duration  s, of the step
void fall_asleep(const BodyWorld& world, BodyWorldState& state, double duration);

/// Wakes a body and those that fell asleep with it.
void wake(BodyWorldState& state, std::uint32_t body);

}  // namespace palpate::rendering
