#pragma once
// A scene with soft objects. Rigid objects are rendered as usual, in a scene of their own inside
// it; the wrenches add up. World frame, SI units.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/soft_body.h"
#include "rendering/bodies/soft/soft_surface.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

// Contact of a tool with a radius and a soft body, at the servo's rate: the body's place and
// compliance between two of its steps. World frame, SI units. Nothing here throws or allocates,
// except construction of the memory.
//
// The ideal tool is the virtual one, moved (not turned) by a spring of the contact stiffness. Every
// edge of the surface near a segment of the tool, and every triangle near an end of the tool, must
// stay outside the tool's radius: gap_i = g_i + sum of W_ij F_j >= 0, F_i >= 0, gap_i F_i = 0. W is
// the body's compliance at those places within a step (Saupin, Duriez & Cotin 2008, "Contact model
// for haptic medical simulations") with the spring in series, so the number of places changes no
// stiffness. Solved by projected Gauss-Seidel.

// Nearest points of segments and triangles. Pure; m.

struct Segment {
  Vec3 from, along;  ///< to its other end; zero: a point
};

struct NearestOnSegments {
  double own = 0, other = 0;  ///< 0 to 1, on each
};

/// Where two segments are nearest to each other; for parallel ones, the middle of their common
/// length. Ericson 2005, "Real-time collision detection", 5.1.9.
inline NearestOnSegments nearest_on_segments(const Segment& own, const Segment& other) {
  const Vec3 r = own.from - other.from;
  const double a = glm::dot(own.along, own.along), e = glm::dot(other.along, other.along);
  const double f = glm::dot(other.along, r);
  const auto part = [](double x) { return std::clamp(x, 0.0, 1.0); };
  if (!(a > 0)) return {0, e > 0 ? part(f / e) : 0};
  const double c = glm::dot(own.along, r);
  if (!(e > 0)) return {part(-c / a), 0};
  const double b = glm::dot(own.along, other.along), det = a * e - b * b;
  double s = 0;
  if (det > 1e-12 * a * e) {
    s = part((b * f - c * e) / det);
  } else {
    const double first = -c / a, last = (b - c) / a;  // the other's ends on this one
    const double low = part(std::min(first, last)), high = part(std::max(first, last));
    s = 0.5 * (low + high);
  }
  double t = (b * s + f) / e;
  if (t < 0) {
    t = 0;
    s = part(-c / a);
  } else if (t > 1) {
    t = 1;
    s = part((b - c) / a);
  }
  return {s, t};
}

/// Weights of the corners for the foot of p's perpendicular; false: the foot is outside the
/// triangle.
inline bool foot_in_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
                             std::array<double, 3>& weights) {
  const Vec3 u = b - a, v = c - a, w = p - a, n = glm::cross(u, v);
  const double nn = glm::dot(n, n);
  if (!(nn > 0)) return false;
  const double beta = glm::dot(glm::cross(w, v), n) / nn;
  const double gamma = glm::dot(glm::cross(u, w), n) / nn;
  weights = {1 - beta - gamma, beta, gamma};
  return weights[0] > 0 && beta > 0 && gamma > 0;
}

/// Whether the segment crosses the triangle; touching counts.
inline bool crosses(const Segment& s, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = glm::cross(b - a, c - a);
  const double before = glm::dot(s.from - a, n), after = before + glm::dot(s.along, n);
  if ((before > 0) == (after > 0)) return false;
  const Vec3 at = s.from + before / (before - after) * s.along;
  std::array<double, 3> weights{};
  return foot_in_triangle(at, a, b, c, weights);
}

inline double distance_to_triangle(const Segment& s, const Vec3& a, const Vec3& b, const Vec3& c) {
  if (crosses(s, a, b, c)) return 0;
  double least = INFINITY;
  const auto edge = [&](const Vec3& from, const Vec3& to) {
    const NearestOnSegments at = nearest_on_segments(s, {from, to - from});
    least =
        std::min(least, glm::distance(s.from + at.own * s.along, from + at.other * (to - from)));
  };
  edge(a, b);
  edge(b, c);
  edge(c, a);
  for (const double along : {0.0, 1.0}) {
    const Vec3 p = s.from + along * s.along;
    std::array<double, 3> w{};
    if (foot_in_triangle(p, a, b, c, w))
      least = std::min(least, glm::distance(p, w[0] * a + w[1] * b + w[2] * c));
  }
  return least;
}

/// Signed; positive if p sees the triangle from behind (its normal points away). Van Oosterom &
/// Strackee 1983, "The solid angle of a plane triangle".
inline double solid_angle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = a - p, v = b - p, w = c - p;
  const double x = glm::length(u), y = glm::length(v), z = glm::length(w);
  return 2 * std::atan2(glm::dot(u, glm::cross(v, w)),
                        x * y * z + glm::dot(u, v) * z + glm::dot(v, w) * x + glm::dot(w, u) * y);
}

/// One contact place of a segment of the tool with the surface.
struct SoftContact {
  std::uint32_t key = 0;  ///< edge, or triangle and segment end; identifies the contact
  int segment = 0;
  std::array<std::uint32_t, 3> nodes{};  ///< surface nodes that bear the force
  std::array<double, 3> weights{};
  std::uint32_t count = 0;  ///< of nodes
  Vec3 normal;              ///< unit, from the surface to the tool's axis
  Vec3 axis_point;          ///< m, on the axis of the virtual segment
  double along = 0;         ///< of the segment: 0 to 1
  double gap = 0;           ///< m, without any force
  double now = 0;           ///< m, the gap with the last forces
  double force = 0;         ///< N
};

struct SoftContactSettings {
  double radius = 0.002;   ///< m, of the tool
  double stiffness = 800;  ///< N/m, of the spring between virtual and ideal tool
  std::size_t most = 64;   ///< contacts at once; of more, the deepest are kept
  int sweeps = 60;         ///< of Gauss-Seidel, at most
};

/// State between ticks.
struct SoftContactMemory {
  SoftContactMemory() = default;
  SoftContactMemory(const SoftBody& body, const SoftContactSettings& settings);

  Vec3 shift{0, 0, 0};                ///< m, from the virtual to the ideal tool
  std::vector<SoftContact> contacts;  ///< of the last tick; some without force
  std::vector<NodeForce> forces;      ///< on the body, of the last tick
  double moved = 0;                   ///< m, motion of the surface by those forces, at most
  bool dropped = false;               ///< there were more contacts than are kept

  // Of the current tick:
  struct Node {
    std::uint32_t node;
    Vec3 base;  ///< m, without any force
    Vec3 now;   ///< m, with the last forces
  };
  std::vector<SoftContact> found;
  std::vector<Node> local;
  std::vector<std::uint32_t> slot;  ///< by surface node; valid if local[slot].node equals it
  std::vector<double> matrix;
};

/// One body's surface at one moment.
struct SoftMoment {
  const SoftBody& body;
  const SoftSurface& surface;
  const SoftView& view;
  double fraction = 0;  ///< of a step since the view
};

/// Moves the ideal tool.
/// \param tip   m, of the virtual tool
/// \param tool  its segments, relative to the tip
/// \param step  m, by which the virtual tool moved since the last call, at most
/// \return the force on the tool, N
Vec3 follow_surface(const SoftMoment& moment, const SoftContactSettings& settings, const Vec3& tip,
                    const PlacedTool& tool, double step, SoftContactMemory& memory) noexcept;

/// Whether the tool's axis is inside the surface, or closer to it than the tool's radius.
bool is_inside(const SoftMoment& moment, double radius, const Vec3& tip,
               const PlacedTool& tool) noexcept;

// A soft body at its own rate, and a tool at the servo's rate. Between two steps the servo follows
// the surface by the body's compliance; the body gets the mean of the forces since its last step.
// World frame, SI units.
//
// With the mean force as the reference, the surface of a linear body does not jump when a step's
// result arrives: under a constant force, the new view begins where the old one ends.

/// A soft object of a scene. Immutable.
struct SoftObject {
  SoftObject(std::shared_ptr<const SoftBody> what, const SoftContactSettings& how, int index)
      : body(std::move(what)), surface(*body), contact(how), object(index) {
    for (const std::uint32_t node : body->surface_nodes()) rest.push_back(body->mesh().nodes[node]);
  }
  /// m, mean distance between neighbouring nodes of the surface at rest: a tool with a smaller
  /// radius feels the elements.
  double node_spacing() const;

  std::shared_ptr<const SoftBody> body;
  SoftSurface surface;
  SoftContactSettings contact;
  std::vector<Vec3> rest;  ///< m, of the nodes of the surface
  int object = 0;          ///< index in the scene
  /// Share of a step. A step's result is used this long after the request, even if it is ready
  /// earlier. This leaves time for a separate thread, and a recorded path gives the same result
  /// without one.
  double delay = 0.5;
};

/// Makes the steps of one soft body elsewhere, for example in a separate thread. Functions return
/// at once.
class SoftStepper {
 public:
  virtual ~SoftStepper() = default;
  /// Requests a step with these forces. The previous step must have been taken.
  virtual void ask(std::span<const NodeForce> forces) noexcept = 0;
  /// Whether the requested step is complete.
  virtual bool ready() const noexcept = 0;
  /// Call when ready: swaps `view` for the one after the step. False: the body has failed.
  virtual bool take(SoftView& view) noexcept = 0;

 protected:
  SoftStepper() = default;
  SoftStepper(const SoftStepper&) = default;
  SoftStepper& operator=(const SoftStepper&) = default;
};

/// When the results of requested steps are used.
enum class SoftPace : std::uint8_t {
  when_due,   ///< each at its time, also within long ticks
  this_tick,  ///< the step due by the end of this tick, if requested before it
  hold,       ///< none in this tick
};

struct SoftObjectState {
  SoftState body;
  SoftView view;          ///< used by the servo
  double view_age = 0;    ///< s
  double since_step = 0;  ///< s, since a step was requested
  bool waiting = false;   ///< a step was requested and is not in the view yet
  SoftContactMemory contact;
  std::vector<Vec3> impulse;            ///< N s, on the surface nodes since the request
  std::vector<std::uint32_t> impelled;  ///< nodes with an impulse
  std::vector<NodeForce> mean;          ///< N, of the requested step
  bool off = false;                     ///< no force until the tool has left the object once
  bool started = false;
  SoftPace pace = SoftPace::when_due;
  SoftStepper* stepper = nullptr;  ///< null: steps are made here, within the tick. Copies have none
  bool failed = false;             ///< a step gave NaN or a far position: no force from now on
};

/// Whether a requested step is due after another dt.
bool step_is_due(const SoftObject& object, const SoftObjectState& state, double dt) noexcept;

/// s; a step this late counts as stalled.
inline constexpr double kStalledAfter = 0.1;
bool is_stalled(const SoftObjectState& state) noexcept;

/// Makes one step and updates the servo's view. Not called by the servo's thread if a stepper has
/// its own.
/// \return false: the result is NaN or far away
bool step_and_look(const SoftObject& object, SoftState& body, std::span<const NodeForce> forces,
                   SoftView& view) noexcept;

SoftObjectState initial_state(const SoftObject& object);
/// Gives a copy the capacity of its original, so that its ticks do not allocate.
void keep_room(const SoftObjectState& original, SoftObjectState& copy);

/// Advances by dt with the tool at its place at the end of dt. Does not allocate or throw.
/// \param dt    s, at most the body's step
/// \param step  m, by which the tool moved, at most
/// \return the force on the tool, N
Vec3 advance(const SoftObject& object, SoftObjectState& state, const Vec3& tip,
             const PlacedTool& tool, double step, double dt) noexcept;

// From the description of a soft object to its rendering: its elements, its fixed nodes, and the
// rate of its steps. Not for the servo.

/// How a soft object is touched, beyond its own description.
struct SoftTouch {
  double radius = 0.002;  ///< m, of the tool
  Vec3 gravity{0, 0, 0};  ///< m/s^2
  int object = 0;         ///< index in the scene
};

/// s, cost of a step with so many elements and entries of the factor. Computed from counts, so that
/// the rate is the same on every computer. Twice the measured time.
double step_cost(std::size_t hexahedra, std::size_t tetrahedra, std::size_t factor_entries);

/// Whether tools of any size with springs up to 3 kN/m come to rest on a body of this material
/// stepped at this rate (Hz). Found by simulation: `palpate stability --soft`.
bool coupling_is_stable(const SoftMaterial& material, double rate);

/// With a resolution of 0, uses the highest up to 10 that can be stepped. The rate is the highest
/// of 1000, 500, 250, 125 and 62.5 Hz at which a step takes at most a quarter of the time.
/// \param spec  with `soft`
/// \param pose  of its local frame in the world
/// \throws stimuli::MeshError: a file's faults, an element that is flat, more elements than can be
/// stepped at 62.5 Hz, nothing near a fixed point, a size of more than 2 m or less than 1 mm
std::shared_ptr<const SoftObject> build_soft_object(const stimuli::ObjectSpec& spec,
                                                    const Pose& pose, const SoftTouch& touch);

/// The present state of a soft object, for drawing.
struct SoftShape {
  int object = 0;                                           ///< index in the scene
  std::span<const Vec3> rest, now;                          ///< m, of the nodes of the surface
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
};

/// \param others  the scene of all rigid objects, with the same tool
/// \param shown   the parts of all objects at rest, for queries of where objects are
/// \param soft    at least one
Scene soft_scene(Scene others, std::vector<SceneObject> shown,
                 std::vector<std::shared_ptr<const SoftObject>> soft, bool side_contact,
                 const Tool& tool);

/// Empty if nothing is soft. Valid until the state's next tick, which changes them in place.
std::vector<SoftShape> soft_shapes(const Scene& scene, const RenderState& state);

/// Every contact with force between tool and soft object in the last tick: place on the ideal
/// tool's axis, m, and force on the tool, N. No allocation.
using SoftContactVisit = void (*)(void* whom, const Vec3& place, const Vec3& force);
void visit_soft_contacts(const RenderState& state, SoftContactVisit visit, void* whom) noexcept;
template <class Visit>
void for_each_soft_contact(const RenderState& state, Visit visit) noexcept {
  visit_soft_contacts(
      state,
      [](void* whom, const Vec3& place, const Vec3& force) {
        (*static_cast<Visit*>(whom))(place, force);
      },
      &visit);
}

/// Uses results of steps as a servo does, tick by tick: a step requested in one tick arrives in a
/// later one. All due steps arrive together, or none if one is not ready (fault kSoftLate).
void pace_by_tick(RenderState& state);

/// Makes due steps wait in the next tick of a state paced by tick. A replay that holds the ticks
/// with the fault kSoftLate gives the recorded result. No allocation.
void hold_steps(RenderState& state, bool held) noexcept;

/// The same as pace_by_tick, with steps made elsewhere. Call right after initial_state().
/// \param steppers  of soft_objects(scene), in order; they must outlive the state's use
void step_elsewhere(RenderState& state, std::span<SoftStepper* const> steppers);

/// The soft objects of a scene.
std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene);

}  // namespace palpate::rendering
