#pragma once
// Bodies that move and collide, without a probe: their constants and their state. World frame, SI
// units.

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
  std::vector<CollidingPart> parts;  ///< empty: it is not convex, nor of convex parts
  /// In its frame; null: it has parts and meets only such as have some.
  std::shared_ptr<const CollisionSurface> surface;
  double radius = 0;  ///< m, about the centre of mass
  BodyMotion start;
  Pose placed;           ///< where the scene put the body's frame
  double stiffness = 0;  ///< N/m, of its surface; beyond limits refused
};

/// One object that stands still.
struct Obstacle {
  int object = 0;
  std::vector<CollidingPart> parts;                 ///< as of MovingBody
  std::shared_ptr<const CollisionSurface> surface;  ///< in the world's frame
  Vec3 centre;
  double radius = 0;
};

/// Two parts that may touch; of a pair that meets by its surfaces, the only one, without meaning.
struct PartPair {
  std::uint32_t part_a = 0, part_b = 0;
};

/// A body and another, or an obstacle.
struct BodyPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;  ///< index of the body, or of the obstacle
  bool obstacle = false;
  bool by_surface = false;             ///< not by convex parts
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

/// Where two bodies were when the distances of their parts were measured (GapMemory::least). While
/// they have moved by less, parts that were far apart still are.
struct PairPlaces {
  Vec3 centre_a, centre_b;
  Quat orientation_a{1, 0, 0, 0}, orientation_b{1, 0, 0, 0};
  double least = -HUGE_VAL;  ///< m; no part of one was closer to any of the other
};

/// The state that a step changes and its working memory.
struct BodyWorldState {
  std::vector<BodyMotion> motion;
  std::vector<GapMemory> gaps;       ///< of each part pair
  std::vector<PairPlaces> measured;  ///< of each pair
  std::vector<SleepState> sleep;
  std::size_t sleeping = 0;         ///< bodies
  bool dropped = false;             ///< contacts or their friction were, since this was reset
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
    bool touches = false;  ///< gap at most BodyContacts::kTouching
    bool apart = false;    ///< in free motion they do not meet before the next event
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
SurfacePlace place_of(const CollisionSurface& surface, const Pose& frame);

/// Energy (J) and momenta (SI units) of all bodies.
double kinetic_energy(const BodyWorld& world, const BodyWorldState& state);
Vec3 momentum(const BodyWorld& world, const BodyWorldState& state);
Vec3 angular_momentum(const BodyWorld& world, const BodyWorldState& state);  ///< about the origin

// A step of bodies that collide. Bodies move freely until a pair meets; there they bounce, and the
// step continues. Bodies that touch or may meet within the rest of the step are held apart by
// impulses that solve a linear complementarity problem. Nothing here allocates.

/// Moves all bodies.
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

// Bodies that have come to rest sleep: they are neither moved nor held against each other until
// something comes near. Nothing here allocates.

/// Call after a step. Bodies that touch each other fall asleep together once each has been at rest
/// for half a second. Without gravity and damping, a body sleeps only if it has no momentum at all,
/// so that none is lost.
/// \param duration  s, of the step
void fall_asleep(const BodyWorld& world, BodyWorldState& state, double duration);

/// Wakes a body and those that fell asleep with it.
void wake(BodyWorldState& state, std::uint32_t body);

// A mass against a one-sided spring for the length of a tick, in closed form: the mass meets and
// leaves the spring at the exact times within the tick, so that energy is neither gained nor lost.
// A force held constant over a tick gains energy (1 g at 1 kN/m leaves with 2.1 times its speed);
// an implicit one loses it.

/// A depth that grows freely without the spring.
struct SpringStart {
  double depth = 0;      ///< m, at the beginning; negative: spring not met yet
  double speed = 0;      ///< m/s, its growth
  double growth = 0;     ///< m/s^2, constant
  double mass = 1;       ///< kg, effective at the place of contact
  double stiffness = 1;  ///< N/m
};

/// The effect of the spring.
struct SpringPass {
  double impulse = 0;         ///< N s, integral of the force
  double double_impulse = 0;  ///< kg m, time integral of the impulse: mass moves by 1/mass of it
  double depth = 0;           ///< m, at the end
  double speed = 0;           ///< m/s, at the end
};

/// \param duration  s
SpringPass pass_spring(const SpringStart& start, double duration);

/// The contacts of a step and the impulses in them. Internal to body_world.cpp.
class BodyContacts {
 public:
  /// m; closer parts touch. Above rounding, below perception.
  static constexpr double kTouching = 1e-8;
  /// m; parts that meet are at most this far apart, so that they still touch when measured again
  /// with other rounding.
  static constexpr double kMet = 0.75 * kTouching;
  /// Share of a step; contacts this soon after a first one, as at the far end of an edge that lies
  /// almost flat, bounce together with it.
  static constexpr double kAtOnce = 4e-3;

  BodyContacts(const BodyWorld& world, BodyWorldState& state) : world_(world), state_(state) {}

  /// Sets state.near, near_parts and contacts: parts that touch or may meet.
  /// \param within  s, the time in which they may meet
  /// \param extra   m, added to their reach
  /// \param chosen  bodies; empty: all
  void find(double within, double extra = 0, std::span<const char> chosen = {});
  /// The same without contacts, and with one near pair of parts for each pair of bodies.
  void find_near(double within, double extra);

  /// Whether anything is near an awake body, as by find_near. Wakes nothing.
  bool may_touch(std::uint32_t body, double within, double extra);

  /// Makes bodies that touch and approach each other bounce, with the restitution of the pair.
  /// \param left  s, of the step
  /// \param step  s, the whole step, for kAtOnce
  /// \return whether any bounced
  bool bounce(double left, double step);

  /// s, until the next pair meets, at most `most`. Sets NearParts::apart: not meeting until then.
  /// Parts that rest on each other are not apart.
  double time_to_next(double most);

  /// Computes impulses that keep every contact from closing by more than its gap within a step.
  /// Groups of bodies without a meeting by time_to_next move freely. Sets state.push, twist and
  /// pushed.
  /// \param springs  springs that press
  void hold_apart(double step, std::span<PressingSpring> springs);

  /// Adds those impulses to one body.
  void add_impulses(std::size_t body);

 private:
  using Row = BodyWorldState::Row;

  Pose pose_of(std::uint32_t body) const;
  Pose pose_of_other(const BodyPair& pair) const;
  const CollidingPart& part_b(const BodyPair& pair, std::uint32_t part) const;
  void place_parts(std::uint32_t body);
  void find_in_pair(std::uint32_t index, double within, double extra, bool places);
  void measure_parts(std::uint32_t index, std::uint32_t parts_index, double reach, bool places);
  void measure_surfaces(std::uint32_t index, double reach, double turn, bool places);
  void add_contact(std::uint32_t index, const Vec3& place, const Vec3& normal, double gap);
  const CollisionSurface& surface_b(const BodyPair& pair) const;
  double moved_since(const BodyPair& pair, const PairPlaces& measured) const;
  void begin_search();
  void look_at_pair(std::uint32_t index, double within, double extra, bool places);
  void look_for(double within, double extra, std::span<const char> chosen, bool places);
  bool wake_near();
  double turning_of(const BodyPair& pair) const;
  Gap gap_after(const BodyWorldState::NearParts& near, double time, double enough,
                GapMemory& memory, Vec3& closing) const;
  double meeting_time(const BodyWorldState::NearParts& parts, double most);
  double meeting_again(BodyWorldState::NearParts& parts, double most);
  struct TimeAndGap {
    double time = 0, gap = 0;
  };
  double meeting_between(const BodyWorldState::NearParts& parts, TimeAndGap low, TimeAndGap high,
                         GapMemory& memory) const;
  void set_velocities(double step);
  void find_islands();
  double resting_speed(double step) const;
  double separation_speed(const BodyContact& contact) const;
  void add_row(std::uint32_t a, std::uint32_t b, const Vec3& place, const Vec3& direction,
               double least_speed, double bound, int leader, int spring);
  void add_friction(const BodyContact& contact, int leader, double friction);
  void begin_rows();
  void solve_rows(std::span<PressingSpring> springs, double step);
  bool makes_energy() const;
  void solve_bounce();
  void apply_rows(std::span<PressingSpring> springs);

  const BodyWorld& world_;
  BodyWorldState& state_;
};

}  // namespace palpate::rendering
