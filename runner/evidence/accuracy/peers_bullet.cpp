// Bullet: GJK, and EPA if it finds an overlap. https://pybullet.org, zlib licence.

#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>
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

}  // namespace

std::unique_ptr<Peer> make_bullet(const stimuli::ConvexMesh& mesh) {
  return std::make_unique<Bullet>(mesh);
}

}  // namespace palpate::runner::evidence::peers
