#pragma once
// A soft body at its own rate, and a tool at the servo's rate. Between two steps the servo follows
// the surface by the body's compliance; the body gets the mean of the forces since its last step.
// World frame, SI units.
//
// With the mean force as the reference, the surface of a linear body does not jump when a step's
// result arrives: under a constant force, the new view begins where the old one ends.

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/soft_body.h"
#include "rendering/bodies/soft/soft_contact.h"
#include "rendering/bodies/soft/soft_surface.h"
#include "rendering/tool.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

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

}  // namespace palpate::rendering
