#pragma once
// A soft body at its own rate and a tool at the servo's. Between two steps the servo follows the
// surface by the body's compliance; the body gets the mean of the forces since its last step. World
// frame, SI units.
//
// With the mean force as the reference, the surface does not jump when a step comes in, as long as
// the body is linear: where the old view ends with a force held, the new one begins.

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/soft_contact.h"

namespace palpate::rendering {

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
  bool failed = false;  ///< a step gave what is no number, or is far away: no force any more
};

/// Whether the step that was asked for, if one was, is due after dt more.
bool step_is_due(const SoftObject& object, const SoftObjectState& state, double dt) noexcept;

/// s; a step that is so late counts as stalled.
inline constexpr double kStalledAfter = 0.1;
bool is_stalled(const SoftObjectState& state) noexcept;

/// One step, and what the servo knows after it. Not by the servo's thread where it has one of its
/// own. \return false: what came out is no number, or is far away
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

}  // namespace palpate::rendering
