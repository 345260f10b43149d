#pragma once
// A scene with soft objects. Rigid objects are rendered as usual, in a scene of their own within;
// the wrenches add up. World frame, SI units.

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/soft_contact.h"
#include "rendering/scene.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

// A soft body at its own rate and a tool at the servo's. Between two steps the servo follows the
// surface by the body's compliance; the body gets the mean of the forces since its last step. World
// frame, SI units.
//
// With the mean force as the reference, the surface does not jump when a step comes in, as long as
// the body is linear: where the old view ends with a force held, the new one begins.

/// A soft object of a scene. Immutable.
struct SoftObject {
  SoftObject(std::shared_ptr<const SoftBody> what, const SoftContactSettings& how, int index)
      : body(std::move(what)), surface(*body), contact(how), object(index) {
    for (const std::uint32_t node : body->surface_nodes()) rest.push_back(body->mesh().nodes[node]);
  }
  /// m, between neighbouring nodes of the surface at rest, in the mean: a tool whose radius is less
  /// than that feels the elements.
  double node_spacing() const;

  std::shared_ptr<const SoftBody> body;
  SoftSurface surface;
  SoftContactSettings contact;
  std::vector<Vec3> rest;  ///< m, of the nodes of the surface
  int object = 0;          ///< index in the scene
  /// Of a step: so long after it was asked for its result is used, whether it has been there before
  /// or not. So a thread of its own has time for it, and a recorded path comes out the same
  /// without.
  double delay = 0.5;
};

/// Makes the steps of one soft body elsewhere, as in a thread of its own. Functions return at once.
class SoftStepper {
 public:
  virtual ~SoftStepper() = default;
  /// Asks for a step with these forces. The step before must have been taken.
  virtual void ask(std::span<const NodeForce> forces) noexcept = 0;
  /// Whether the step that was asked for has been made.
  virtual bool ready() const noexcept = 0;
  /// Once it is ready: swaps `view` for the one after it. False: the body has failed.
  virtual bool take(SoftView& view) noexcept = 0;

 protected:
  SoftStepper() = default;
  SoftStepper(const SoftStepper&) = default;
  SoftStepper& operator=(const SoftStepper&) = default;
};

/// When the steps that were asked for come in.
enum class SoftPace : std::uint8_t {
  when_due,   ///< each at its time, within long ticks as well
  this_tick,  ///< the one that is due by the end of this tick, if it was asked for before
  hold,       ///< none in this tick
};

struct SoftObjectState {
  SoftState body;
  SoftView view;          ///< that the servo goes by
  double view_age = 0;    ///< s
  double since_step = 0;  ///< s, since a step was asked for
  bool waiting = false;   ///< it was, and is not in the view yet
  SoftContactMemory contact;
  std::vector<Vec3> impulse;            ///< N s, on the surface nodes since then
  std::vector<std::uint32_t> impelled;  ///< those with one
  std::vector<NodeForce> mean;          ///< N, that the step was asked for with
  bool off = false;                     ///< no force until the tool has left it once
  bool started = false;
  SoftPace pace = SoftPace::when_due;
  SoftStepper* stepper = nullptr;  ///< null: steps are made here, within the tick. Copies have none
  bool failed = false;             ///< a step gave NaN or a far position: no force from now on
};

/// Whether the step that was asked for, if one was, is due after dt more.
bool step_is_due(const SoftObject& object, const SoftObjectState& state, double dt) noexcept;

/// s; a step that is so late counts as stalled.
inline constexpr double kStalledAfter = 0.1;
bool is_stalled(const SoftObjectState& state) noexcept;

/// One step, and what the servo knows after it. Not by the servo's thread where it has one of its
/// own. \return false: the result is NaN or far away
bool step_and_look(const SoftObject& object, SoftState& body, std::span<const NodeForce> forces,
                   SoftView& view) noexcept;

SoftObjectState initial_state(const SoftObject& object);
/// Gives a copy the room that its original has, so that ticks of it do not allocate.
void keep_room(const SoftObjectState& original, SoftObjectState& copy);

/// Goes on for dt with the tool where it is at the end of it. No allocation, nothing thrown.
/// \param dt    s, at most the body's step. \param step  m, by which the tool moved, at most
/// \return the force on the tool, N
Vec3 advance(const SoftObject& object, SoftObjectState& state, const Vec3& tip,
             const PlacedTool& tool, double step, double dt) noexcept;

// From the description of a soft object to its rendering: its elements, which of them are held, and
// the rate of its steps. Not for the servo.

/// How a soft object is touched, beyond its own description.
struct SoftTouch {
  double radius = 0.002;  ///< m, of the tool
  Vec3 gravity{0, 0, 0};  ///< m/s^2
  int object = 0;         ///< index in the scene
};

/// What a step of so many elements and entries of the factor takes, s: by counting, so that a rate
/// that depends on it is the same on every computer. Twice what it took where it was measured.
double step_cost(std::size_t hexahedra, std::size_t tetrahedra, std::size_t factor_entries);

/// Whether tools of any size and springs up to 3 kN/m come to rest on a body of that material which
/// is stepped at that rate (Hz): found by simulation, `palpate stability --soft`.
bool coupling_is_stable(const SoftMaterial& material, double rate);

/// With a resolution of 0, the highest up to 10 that can be stepped. Steps at the highest of 1000,
/// 500, 250, 125 and 62.5 Hz of which they take a quarter at most. \param spec  with `soft`. \param
/// pose  of its local frame in the world \throws stimuli::MeshError: a file's faults, an element
/// that is flat, more elements than can be stepped at 62.5 Hz, nothing near a fixed point, a size
/// of more than 2 m or less than 1 mm
std::shared_ptr<const SoftObject> build_soft_object(const stimuli::ObjectSpec& spec,
                                                    const Pose& pose, const SoftTouch& touch);

/// The present state of a soft object, for drawing.
struct SoftShape {
  int object = 0;                                           ///< index in the scene
  std::span<const Vec3> rest, now;                          ///< m, of the nodes of the surface
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
};

/// \param others  the scene of all objects that do not give, with the same tool
/// \param shown   the parts of all objects, at rest: for what only asks where objects are
/// \param soft    at least one
Scene soft_scene(Scene others, std::vector<SceneObject> shown,
                 std::vector<std::shared_ptr<const SoftObject>> soft, bool side_contact,
                 const Tool& tool);

/// Empty where nothing is soft. Valid until the state's next tick, which changes them in place.
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

/// Steps come in as they do at a servo, tick by tick: one that was asked for in a tick in a later
/// one, all that are due, or none of them where one is not ready (fault kSoftLate).
void pace_by_tick(RenderState& state);

/// Before a tick, of a state that is paced: steps that are due in it wait. Held in the ticks that
/// have the fault kSoftLate, a recorded path comes out the same. No allocation.
void hold_steps(RenderState& state, bool held) noexcept;

/// The same, with the steps made elsewhere. Right after initial_state().
/// \param steppers  of soft_objects(scene), in order; they must outlive the state's use
void step_elsewhere(RenderState& state, std::span<SoftStepper* const> steppers);

/// The soft objects of a scene; empty where there are none.
std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene);

}  // namespace palpate::rendering
