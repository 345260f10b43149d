#include "rendering/bodies/moving_scene.h"
#include "rendering/probe.h"
#include "rendering/renderer.h"
#include "rendering/scene_motion.h"
#include "runner/evidence/accuracy/body_study.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

/// Our own engine, as a scene with a probe far from all bodies.
class OwnBodies final : public BodyEngine {
 public:
  explicit OwnBodies(const BodyCase& of) : scene_(scene_of(of)), state_(scene_.initial_state()) {
    rendering::point_renderer().tick(scene_, state_, kFar, 0);
  }
  void step(double dt) override { rendering::point_renderer().tick(scene_, state_, kFar, dt); }
  std::vector<BoxMotion> motion() const override {
    std::vector<BoxMotion> out;
    for (const rendering::BodyPose& body : state_.motion.bodies())
      out.push_back({body.centre, body.orientation, body.velocity, body.spin});
    return out;
  }

 private:
  static rendering::Scene scene_of(const BodyCase& of) {
    std::vector<rendering::SceneObject> parts;
    std::vector<rendering::MovingObject> moving;
    for (std::size_t i = 0; i < of.boxes.size(); ++i) {
      const BodyBox& box = of.boxes[i];
      rendering::SceneObject part;
      part.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::box(box.size));
      part.pose = box.pose;
      part.object = static_cast<int>(i);
      parts.push_back(part);
      if (!(box.mass > 0)) continue;
      rendering::MovingObject object;
      object.object = part.object;
      object.pose = box.pose;
      object.body.mass = box.mass;
      object.body.velocity = box.velocity;
      object.body.spin = box.spin;
      object.body.restitution = box.restitution;
      object.body.friction = box.friction;
      moving.push_back(object);
    }
    // Without sleep: a sleeping body would keep its place without being computed.
    return moving_scene(std::move(parts), moving, of.gravity, false, {}, false);
  }

  static constexpr rendering::LineProbe kFar{Vec3(100), Vec3(100)};
  rendering::Scene scene_;
  rendering::RenderState state_;
};

}  // namespace

std::vector<BodyEngineKind> body_engines() {
  std::vector<BodyEngineKind> kinds;
  kinds.push_back({"palpate", [](const BodyCase& of) -> std::unique_ptr<BodyEngine> {
                     return std::make_unique<OwnBodies>(of);
                   }});
#ifdef PALPATE_BULLET_VERSION
  kinds.push_back({"bullet " PALPATE_BULLET_VERSION, peers::make_bullet_bodies});
#endif
#ifdef PALPATE_ODE_VERSION
  kinds.push_back({"ode " PALPATE_ODE_VERSION, peers::make_ode_bodies});
#endif
  return kinds;
}

}  // namespace palpate::runner::evidence
