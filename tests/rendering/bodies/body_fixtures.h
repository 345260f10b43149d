#pragma once
// Bodies and scenes for tests.

#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "rendering/bodies/body_world.h"
#include "rendering/bodies/moving_bodies.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/bodies/rigid_motion.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::rendering::test {

using Mesh = std::shared_ptr<const stimuli::ConvexMesh>;

inline Mesh mesh_of(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}
inline Mesh box_mesh(const Vec3& size) { return mesh_of(stimuli::box(size)); }

/// Collects objects one by one, then builds a scene.
class BodyScene {
 public:
  Vec3 gravity{0, 0, 0};
  double stiffness = 1000, damping = 0;
  bool sleeps = true;

  void stands(const Mesh& mesh, const Pose& pose) { add(mesh, pose, next_++); }
  stimuli::Body& moves(const Mesh& mesh, const Pose& pose, double mass) {
    return moves(std::vector<std::pair<Mesh, Pose>>{{mesh, Pose{}}}, pose, mass);
  }
  /// \param parts  in the object's frame
  stimuli::Body& moves(const std::vector<std::pair<Mesh, Pose>>& parts, const Pose& pose,
                       double mass) {
    for (const auto& [mesh, at] : parts)
      add(mesh, {pose.orientation * at.position + pose.position, pose.orientation * at.orientation},
          next_);
    stimuli::Body body;
    body.mass = mass;
    moving_.push_back({next_++, body, pose});
    return moving_.back().body;
  }
  Scene scene(bool sides = true, const Tool& tool = {}) const {
    return moving_scene(parts_, moving_, gravity, sides, tool, sleeps);
  }

 private:
  void add(const Mesh& mesh, const Pose& pose, int object) {
    SceneObject part;
    part.mesh = mesh;
    part.pose = pose;
    part.object = object;
    part.material.stiffness = stiffness;
    part.material.damping = damping;
    parts_.push_back(part);
  }
  std::vector<SceneObject> parts_;
  std::vector<MovingObject> moving_;
  int next_ = 0;
};

inline const BodyWorld& body_world_of(const Scene& scene) {
  return static_cast<const MovingBodies&>(*scene.motion()).world();
}
inline const BodyWorldState& body_state_of(const RenderState& state) {
  return static_cast<const BodiesState&>(*state.motion.get()).world;
}

/// Energy (J) and momenta (SI units) of all bodies; angular about the origin.
inline double kinetic_energy(const BodyWorld& world, const BodyWorldState& state) {
  double sum = 0;
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    sum += kinetic_energy(world.bodies[i].inertia, state.motion[i]);
  return sum;
}

inline Vec3 momentum(const BodyWorld& world, const BodyWorldState& state) {
  Vec3 sum(0);
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    sum += world.bodies[i].inertia.mass * state.motion[i].velocity;
  return sum;
}

inline Vec3 angular_momentum(const BodyWorld& world, const BodyWorldState& state) {
  Vec3 sum(0);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const BodyMotion& motion = state.motion[i];
    sum += motion.spin_momentum +
           world.bodies[i].inertia.mass * glm::cross(motion.centre, motion.velocity);
  }
  return sum;
}

/// A probe far from everything.
inline LineProbe far_probe() { return {{50, 50, 50}, {50, 50, 50.12}}; }

/// Ticks of the point renderer with a probe that stands still.
inline void run(const Scene& scene, RenderState& state, double seconds, double dt = 1e-3,
                const LineProbe& probe = far_probe()) {
  const int ticks = static_cast<int>(std::lround(seconds / dt));
  if (!state.has_last) point_renderer().tick(scene, state, probe, 0);
  for (int i = 0; i < ticks; ++i) point_renderer().tick(scene, state, probe, dt);
}

}  // namespace palpate::rendering::test
