#pragma once
// Motion of a scene's bodies under the probe. Each body is rendered in its own frame, where it
// stands still, so the contact law and the ideal tool move with it. The force on the hand acts on
// the body in the opposite direction.

#include <cstddef>
#include <glm/geometric.hpp>
#include <memory>
#include <span>
#include <vector>

#include "rendering/bodies/body_world.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "rendering/union_contact.h"

namespace palpate::rendering {

inline Vec3 into(const Pose& frame, const Vec3& world) {
  return glm::conjugate(frame.orientation) * (world - frame.position);
}
inline LineProbe into(const Pose& frame, const LineProbe& probe) {
  return {into(frame, probe.tip), into(frame, probe.tail)};
}

inline ToolPose into(const Pose& frame, const LineProbe& probe, const Mat3& tool) {
  const Mat3 back = glm::mat3_cast(glm::conjugate(frame.orientation));
  const Vec3 tip = into(frame, probe.tip);
  return {tip, into(frame, probe.tail) - tip, back * tool};
}

inline Vec3 out_of(const Pose& frame, const Vec3& local) {
  return frame.orientation * local + frame.position;
}

/// A contact of the probe with a body, world frame.
struct ProbeContact {
  PressingSpring spring;
  Vec3 on_probe;           ///< m; the contact's place on the virtual probe
  double along = 0;        ///< its fraction of the way from tip to tail
  Vec3 offset;             ///< m, along the surface, of friction's spring
  Vec3 tangential;         ///< N, of friction, on the hand
  double force = 0;        ///< N, along the normal, on the hand
  double felt_depth = 0;   ///< m; force = stiffness times this depth
  double depth_after = 0;  ///< m, at the end of the step, for a spring in closed form
  int segment = 0;
  Vec3 moved;     ///< m, motion of the place on the virtual probe within the step
  Vec3 pressing;  ///< unit; the mean normal of the step, for a spring in closed form
};

class BodiesState final : public MotionState {
 public:
  std::unique_ptr<MotionState> clone() const override;
  std::span<const BodyPose> bodies() const override { return poses; }
  void pull(const BodyPull& by) noexcept override { drawn = by; }

  RenderState fixed;                ///< of obstacles
  std::vector<RenderState> shapes;  ///< of each body, in its frame
  BodyWorldState world;
  std::vector<BodyPose> poses;
  std::vector<BodyMotion> before;  ///< at the beginning of the step
  std::vector<BodyMotion> ahead;   ///< at its end if there were no probe
  std::vector<Rendering> felt;     ///< of each body, in its frame
  std::vector<Pose> shown;         ///< that frame
  std::vector<char> chosen;
  /// The spring on a body at the end of the last step, in the body's frame. The next step continues
  /// it if the probe leaves the body within that step.
  struct Held {
    bool holds = false;
    ProbeContact contact;
    Vec3 on_tool;  ///< m, of the place on the probe, in the frame of the tool
    ContactType type = ContactType::none;
    double deepest = 0;     ///< m; of the springs that pressed at the end of the last step
    bool balanced = false;  ///< the next two values are known
    double energy = 0;      ///< J, the body's due energy when it leaves the probe
    double leeway = 0;      ///< J, possible errors of steps not yet corrected
  };
  std::vector<Held> held;
  std::size_t most_contacts = 0;
  std::vector<ProbeContact> contacts;
  std::vector<PressingSpring> springs;
  std::vector<int> inner;           ///< of each body: number of its own steps within a step; or 1
  std::vector<ProbeContact> means;  ///< of bodies with such steps: means over them
  BodyPull drawn;
  LineProbe last;
  Mat3 last_frame = Mat3(1);
  bool has_last = false;
};

class MovingBodies final : public SceneMotion {
 public:
  MovingBodies(BodyWorld world, Scene fixed, std::vector<Scene> shapes);
  std::unique_ptr<MotionState> initial_state() const override;
  Rendering tick(const Renderer& renderer, RenderState& state, const LineProbe& probe,
                 double dt) const noexcept override;
  const BodyWorld& world() const { return world_; }

 private:
  /// A step of the bodies with the probe, from one of its poses to the next.
  struct Stroke {
    LineProbe from, to;
    Mat3 frame_from, frame_to;
    double duration = 0;
    bool touches = true;  ///< false: the probe's pose is invalid
  };
  void step(const Renderer& renderer, BodiesState& state, const Stroke& stroke) const;
  void draw(BodiesState& state, double duration) const;
  Stroke part_of(const Stroke& stroke, int part, int parts) const;
  int inner_steps(const BodiesState& state, std::size_t body, const Stroke& stroke) const;
  bool stays_alone(BodiesState& state, std::size_t body, const Stroke& stroke) const;
  void push_alone(BodiesState& state, std::size_t body, const Stroke& stroke) const;
  void step_finely(const Renderer& renderer, BodiesState& state, std::size_t body,
                   const Stroke& stroke) const;
  void feel(const Renderer& renderer, BodiesState& state, std::size_t body,
            const Stroke& stroke) const;
  void find_probe_contacts(BodiesState& state, std::size_t body, const Stroke& stroke) const;
  void continue_contact(BodiesState& state, const Stroke& stroke, std::size_t body) const;
  void hold(BodiesState& state, const Stroke& stroke, const ProbeContact& contact) const;
  void place_contact(BodiesState& state, const Stroke& stroke, const Pose& frame, const Vec3& shift,
                     ProbeContact contact) const;
  void push_freely(BodiesState& state, ProbeContact& contact, double duration) const;
  void balance(BodiesState& state, ProbeContact& contact, const Vec3& moment,
               double duration) const;
  void add_springs(BodiesState& state, std::size_t first, std::size_t end, double duration) const;
  void push_pressed(BodiesState& state, double duration) const;
  void push_held(BodiesState& state, const Stroke& stroke) const;
  void remember_depth(BodiesState& state, std::size_t body) const;
  void push_sideways(BodiesState& state, ProbeContact& contact, double duration) const;
  void settle(BodiesState& state, const Stroke& stroke) const;
  void settle_shape(BodiesState& state, std::size_t body, const Stroke& stroke) const;
  Rendering sum(const Renderer& renderer, const BodiesState& state, const Rendering& fixed,
                const LineProbe& probe) const;
  void add_body(const Renderer& renderer, const BodiesState& state, std::size_t body,
                const LineProbe& probe, Rendering& out) const;
  Pose pose_of(const BodiesState& state, std::size_t body) const {
    return {state.world.motion[body].centre, state.world.motion[body].orientation};
  }

  BodyWorld world_;
  Scene fixed_;
  std::vector<Scene> shapes_;
};

}  // namespace palpate::rendering
