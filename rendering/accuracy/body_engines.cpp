#include "rendering/accuracy/body_study.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/probe.h"
#include "rendering/renderer.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

/// Our own engine, as a scene with a probe far from all bodies.
class OwnBodies final : public BodyEngine {
 public:
  explicit OwnBodies(const BodyCase& of) : scene_(scene_of(of)), state_(scene_.initial_state()) {
    point_renderer().tick(scene_, state_, kFar, 0);
  }
  void step(double dt) override { point_renderer().tick(scene_, state_, kFar, dt); }
  std::vector<BoxMotion> motion() const override {
    std::vector<BoxMotion> out;
    for (const BodyPose& body : state_.motion.bodies())
      out.push_back({body.centre, body.orientation, body.velocity, body.spin});
    return out;
  }

 private:
  static Scene scene_of(const BodyCase& of) {
    std::vector<SceneObject> parts;
    std::vector<MovingObject> moving;
    for (std::size_t i = 0; i < of.boxes.size(); ++i) {
      const BodyBox& box = of.boxes[i];
      SceneObject part;
      part.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::box(box.size));
      part.pose = box.pose;
      part.object = static_cast<int>(i);
      parts.push_back(part);
      if (!(box.mass > 0)) continue;
      MovingObject object;
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

  static constexpr LineProbe kFar{Vec3(100), Vec3(100)};
  Scene scene_;
  RenderState state_;
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

}  // namespace palpate::rendering
