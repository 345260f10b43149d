// Bullet's rigid bodies: https://pybullet.org, zlib licence.

#include <btBulletDynamicsCommon.h>

#include <cmath>

#include "runner/evidence/accuracy/body_study.h"

namespace palpate::runner::evidence::peers {
namespace {

btVector3 bullet_vector(const Vec3& v) { return {v.x, v.y, v.z}; }
Vec3 plain_vector(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

class BulletBodies final : public BodyEngine {
 public:
  explicit BulletBodies(const BodyCase& of)
      : dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    world_.setGravity(bullet_vector(of.gravity));
    for (const BodyBox& box : of.boxes) add(box);
  }
  ~BulletBodies() override {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  BulletBodies(const BulletBodies&) = delete;
  BulletBodies& operator=(const BulletBodies&) = delete;

  void step(double dt) override { world_.stepSimulation(dt, 0); }
  std::vector<BoxMotion> motion() const override {
    std::vector<BoxMotion> out;
    for (const auto& body : bodies_) {
      if (body->getInvMass() == 0) continue;
      const btQuaternion q = body->getWorldTransform().getRotation();
      out.push_back({plain_vector(body->getWorldTransform().getOrigin()),
                     Quat(q.w(), q.x(), q.y(), q.z()), plain_vector(body->getLinearVelocity()),
                     plain_vector(body->getAngularVelocity())});
    }
    return out;
  }

 private:
  void add(const BodyBox& box) {
    shapes_.push_back(std::make_unique<btBoxShape>(bullet_vector(0.5 * box.size)));
    shapes_.back()->setMargin(0.001 * box.size.x);
    btVector3 inertia(0, 0, 0);
    if (box.mass > 0) shapes_.back()->calculateLocalInertia(box.mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(box.mass, nullptr, shapes_.back().get(), inertia);
    const Quat& q = box.pose.orientation;
    info.m_startWorldTransform =
        btTransform(btQuaternion(q.x, q.y, q.z, q.w), bullet_vector(box.pose.position));
    info.m_restitution = std::sqrt(box.restitution);  // Bullet multiplies those of a pair
    info.m_friction = std::sqrt(box.friction);
    info.m_linearSleepingThreshold = info.m_angularSleepingThreshold = 0;
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setLinearVelocity(bullet_vector(box.velocity));
    bodies_.back()->setAngularVelocity(bullet_vector(box.spin));
    bodies_.back()->setFlags(BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(bodies_.back().get());
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<btBoxShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

}  // namespace

std::unique_ptr<BodyEngine> make_bullet_bodies(const BodyCase& of) {
  return std::make_unique<BulletBodies>(of);
}

}  // namespace palpate::runner::evidence::peers
