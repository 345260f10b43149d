// Bullet: GJK, and EPA if it finds an overlap. https://pybullet.org, zlib licence.

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <cmath>
#include <limits>

#include "runner/evidence/accuracy/peers_hull.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence::peers {
namespace {

btVector3 to_bullet(const Vec3& v) { return {v.x, v.y, v.z}; }
Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// A convex shape given only by a support function.
template <class Body>
class Shape final : public btConvexInternalShape {
 public:
  explicit Shape(Body shape_body) : body(std::move(shape_body)) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    m_collisionMargin = 0;
  }

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    return to_bullet(body.support(from_bullet(direction)));
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions,
                                                         btVector3* out, int count) const override {
    for (int i = 0; i < count; ++i) out[i] = localGetSupportingVertexWithoutMargin(directions[i]);
  }
  void calculateLocalInertia(btScalar, btVector3& inertia) const override {
    inertia.setZero();  // nothing moves here
  }
  const char* getName() const override { return "support function"; }

  Body body;
};

class Bullet final : public Peer {
 public:
  explicit Bullet(const stimuli::ConvexMesh& mesh) : hull_(Hull(mesh)), segment_(Segment{}) {}

  PeerContact contact(const rendering::LineProbe& probe) override {
    const Scale& scale = hull_.body.scale();
    segment_.body = {scale.to_unit(probe.tip), scale.to_unit(probe.tail)};
    const btTransform here = btTransform::getIdentity();
    btGjkEpaSolver2::sResults results;
    if (btGjkEpaSolver2::Penetration(&hull_, here, &segment_, here, guess_, results, false)) {
      guess_ = results.normal;
      // Its normal points from the segment into the hull.
      return {-results.distance * scale.radius, -from_bullet(results.normal),
              scale.from_unit(from_bullet(results.witnesses[0]))};
    }
    if (results.status == btGjkEpaSolver2::sResults::Separated &&
        btGjkEpaSolver2::Distance(&hull_, here, &segment_, here, guess_, results)) {
      guess_ = results.normal;
      return {-results.distance * scale.radius, -from_bullet(results.normal),
              scale.from_unit(from_bullet(results.witnesses[0]))};
    }
    guess_ = btVector3(1, 0, 0);
    return {std::numeric_limits<double>::quiet_NaN(), Vec3(), Vec3()};
  }

 private:
  Shape<Hull> hull_;
  Shape<Segment> segment_;
  btVector3 guess_{1, 0, 0};
};

class BulletMesh final : public Peer {
 public:
  explicit BulletMesh(const PeerMesh& mesh) : centre_(mesh.centre), radius_(mesh.radius) {
    for (const auto& t : mesh.triangles) {
      triangles_.addTriangle(scaled(mesh.vertices[t[0]]), scaled(mesh.vertices[t[1]]),
                             scaled(mesh.vertices[t[2]]));
    }
    shape_ = std::make_unique<btBvhTriangleMeshShape>(&triangles_, true);
    shape_->setMargin(0);
    solid_.setCollisionShape(shape_.get());
    world_.addCollisionObject(&solid_);
  }
  ~BulletMesh() override { world_.removeCollisionObject(&solid_); }
  BulletMesh(const BulletMesh&) = delete;
  BulletMesh& operator=(const BulletMesh&) = delete;

  PeerContact contact(const rendering::LineProbe& probe) override {
    const btVector3 tip = scaled(probe.tip), way = scaled(probe.tail) - tip;
    btCapsuleShapeZ capsule(kThin, way.length());
    btCollisionObject rod;
    rod.setCollisionShape(&capsule);
    btTransform pose(btQuaternion::getIdentity(), tip + 0.5 * way);
    if (way.length() > 0) {
      const btVector3 z = way.normalized();
      pose.setRotation(z.z() < -0.999999 ? btQuaternion(1, 0, 0, 0)
                                         : shortestArcQuat(btVector3(0, 0, 1), z));
    }
    rod.setWorldTransform(pose);
    Deepest deepest(&rod);
    world_.contactPairTest(&rod, &solid_, deepest);
    if (deepest.depth < 0) return {-1, Vec3(), Vec3()};
    return {deepest.depth * radius_, from_bullet(deepest.normal),
            centre_ + radius_ * from_bullet(deepest.point)};
  }

 private:
  struct Deepest final : btCollisionWorld::ContactResultCallback {
    explicit Deepest(const btCollisionObject* moving) : rod(moving) {}
    btScalar addSingleResult(btManifoldPoint& found, const btCollisionObjectWrapper* first, int,
                             int, const btCollisionObjectWrapper*, int, int) override {
      if (-found.getDistance() <= depth) return 0;
      const bool rod_first = first->getCollisionObject() == rod;
      depth = -found.getDistance();
      normal = rod_first ? found.m_normalWorldOnB : -found.m_normalWorldOnB;
      point = rod_first ? found.getPositionWorldOnB() : found.getPositionWorldOnA();
      return 0;
    }
    const btCollisionObject* rod;
    double depth = -1;
    btVector3 normal{0, 0, 0}, point{0, 0, 0};
  };

  btVector3 scaled(const Vec3& v) const { return to_bullet((v - centre_) / radius_); }

  Vec3 centre_;
  double radius_;
  btTriangleMesh triangles_;
  std::unique_ptr<btBvhTriangleMeshShape> shape_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_{&dispatcher_, &broadphase_, &configuration_};
  btCollisionObject solid_;
};

}  // namespace

std::unique_ptr<Peer> make_bullet_mesh(const PeerMesh& mesh) {
  return std::make_unique<BulletMesh>(mesh);
}

std::unique_ptr<Peer> make_bullet(const stimuli::ConvexMesh& mesh) {
  return std::make_unique<Bullet>(mesh);
}

}  // namespace palpate::runner::evidence::peers
