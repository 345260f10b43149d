#pragma once
// The moving objects of a scene, as far as the renderers know them. A scene without moving objects
// has none of this, and its tick does not test for it. World frame, SI units.

#include <memory>
#include <span>
#include <utility>

#include "stimuli/vec.h"

namespace palpate::rendering {

class Renderer;
struct LineProbe;
struct RenderState;
struct Rendering;

/// The pose and velocity of a moving object.
struct BodyPose {
  int object = 0;    ///< index of the object in the scene
  Vec3 centre;       ///< m, of mass
  Quat orientation;  ///< from the object's axes to the world's
  Vec3 velocity;     ///< m/s, of the centre of mass
  Vec3 spin;         ///< rad/s
  Pose moved;        ///< from its place in the scene's description to its present one
};

/// A spring that pulls an object beside the probe, as with the mouse.
struct BodyPull {
  int object = -1;  ///< index in the scene; -1: none is pulled
  Vec3 on_object;   ///< m, world; the place on the object as the scene first placed it
  Vec3 to;          ///< m, world; target of that place
};

/// The state of everything that moves between ticks.
class MotionState {
 public:
  virtual ~MotionState() = default;
  virtual std::unique_ptr<MotionState> clone() const = 0;
  /// By object. Valid until the next tick, which changes them in place.
  virtual std::span<const BodyPose> bodies() const = 0;
  /// Acts from the next tick on until the next call. Objects that cannot be pulled are unaffected.
  virtual void pull(const BodyPull& /*pull*/) noexcept {}

 protected:
  MotionState() = default;
  MotionState(const MotionState&) = default;
  MotionState& operator=(const MotionState&) = default;
};

/// The motion of a scene. Immutable, part of the scene.
class SceneMotion {
 public:
  virtual ~SceneMotion() = default;
  virtual std::unique_ptr<MotionState> initial_state() const = 0;
  /// The whole tick: moves the objects by dt and renders the contact of the probe with the whole
  /// scene.
  virtual Rendering tick(const Renderer& renderer, RenderState& state, const LineProbe& probe,
                         double dt) const noexcept = 0;

 protected:
  SceneMotion() = default;
  SceneMotion(const SceneMotion&) = default;
  SceneMotion& operator=(const SceneMotion&) = default;
};

/// A MotionState that is copied with its owner. Copying allocates; ticks do not copy.
class OwnedMotion {
 public:
  OwnedMotion() = default;
  explicit OwnedMotion(std::unique_ptr<MotionState> state) : state_(std::move(state)) {}
  OwnedMotion(const OwnedMotion& other) : state_(other.state_ ? other.state_->clone() : nullptr) {}
  OwnedMotion(OwnedMotion&&) noexcept = default;
  OwnedMotion& operator=(const OwnedMotion& other) {
    if (this != &other) state_ = other.state_ ? other.state_->clone() : nullptr;
    return *this;
  }
  OwnedMotion& operator=(OwnedMotion&&) noexcept = default;
  ~OwnedMotion() = default;

  MotionState* get() const { return state_.get(); }
  /// Empty if nothing moves.
  std::span<const BodyPose> bodies() const {
    return state_ ? state_->bodies() : std::span<const BodyPose>();
  }

 private:
  std::unique_ptr<MotionState> state_;
};

}  // namespace palpate::rendering
