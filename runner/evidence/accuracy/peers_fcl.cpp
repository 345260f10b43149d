// The Flexible Collision Library: the GJK and EPA behind its signed distance (Drake's choice).
// https://github.com/flexible-collision-library/fcl, BSD licence.
//
// Its collide() uses libccd's MPR, which does not give the least penetration; distance() with
// enable_signed_distance does. This file calls the latter one level below, with support functions:
// a segment is then exact, and the hull can climb. The packaged library is built with assertions,
// some of which fail on thin objects and would end the program. The same code, compiled here
// without them, throws or returns its result so far.

#ifndef NDEBUG
#define NDEBUG
#endif
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>

#include <cmath>
#include <exception>
#include <limits>

#include "runner/evidence/accuracy/peers_hull.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence::peers {
namespace {

constexpr int kMaxSupports = 20000;  // FCL's EPA has no limit

Vec3 from_ccd(const ccd_vec3_t& v) { return {v.v[0], v.v[1], v.v[2]}; }
void to_ccd(const Vec3& v, ccd_vec3_t* out) { ccdVec3Set(out, v.x, v.y, v.z); }

struct HullBody {
  Hull hull;
  Vec3 first;            ///< initial direction of GJK
  mutable int left = 0;  ///< queries left until we give up
};

void support_hull(const void* body, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  const auto& hull = *static_cast<const HullBody*>(body);
  if (--hull.left < 0) throw std::runtime_error("no end");
  to_ccd(hull.hull.support(from_ccd(*direction)), out);
}

void support_segment(const void* body, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  to_ccd(static_cast<const Segment*>(body)->support(from_ccd(*direction)), out);
}

void first_direction(const void* body, const void*, ccd_vec3_t* out) {
  to_ccd(static_cast<const HullBody*>(body)->first, out);
}

class Fcl final : public Peer {
 public:
  explicit Fcl(const stimuli::ConvexMesh& mesh) : body_{Hull(mesh), Vec3(1, 0, 0)} {
    CCD_INIT(&settings_);
    settings_.support1 = support_hull;
    settings_.support2 = support_segment;
    settings_.first_dir = first_direction;
    settings_.max_iterations = 500;                              // FCL's own
    settings_.epa_tolerance = settings_.dist_tolerance = 1e-10;  // of the radius; FCL's own: 1e-6
  }

  PeerContact contact(const rendering::LineProbe& probe) override {
    const Scale& scale = body_.hull.scale();
    const Segment segment{scale.to_unit(probe.tip), scale.to_unit(probe.tail)};
    body_.left = kMaxSupports;
    ccd_vec3_t on_hull, on_segment;
    double distance = -1;
    try {
      distance = fcl::detail::libccd_extension::ccdGJKSignedDist(&body_, &segment, &settings_,
                                                                 &on_hull, &on_segment);
    } catch (const std::exception&) {
      body_.first = Vec3(1, 0, 0);
      return {std::numeric_limits<double>::quiet_NaN(), Vec3(), Vec3()};
    }
    const Vec3 apart = from_ccd(on_segment) - from_ccd(on_hull);
    const double length = glm::length(apart);
    if (!(length > 0)) return {std::numeric_limits<double>::quiet_NaN(), Vec3(), Vec3()};
    body_.first = (distance < 0 ? -1.0 : 1.0) * apart / length;
    return {-distance * scale.radius, body_.first, scale.from_unit(from_ccd(on_hull))};
  }

 private:
  HullBody body_;
  ccd_t settings_;
};

class FclMesh final : public Peer {
 public:
  explicit FclMesh(const PeerMesh& mesh) : centre_(mesh.centre), radius_(mesh.radius) {
    std::vector<fcl::Vector3d> vertices;
    std::vector<fcl::Triangle> triangles;
    for (const Vec3& v : mesh.vertices) vertices.push_back(scaled(v));
    for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    model_.beginModel();
    model_.addSubModel(vertices, triangles);
    model_.endModel();
  }

  PeerContact contact(const rendering::LineProbe& probe) override {
    const fcl::Vector3d tip = scaled(probe.tip), way = scaled(probe.tail) - tip;
    const fcl::Capsuled capsule(kThin, way.norm());
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    if (way.norm() > 0) {
      pose.linear() =
          Eigen::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitZ(), way).toRotationMatrix();
    }
    pose.translation() = tip + 0.5 * way;
    constexpr std::size_t kContacts = 256;
    const fcl::CollisionRequestd request(kContacts, true);
    fcl::CollisionResultd result;
    fcl::collide<double>(&model_, fcl::Transform3d::Identity(), &capsule, pose, request, result);
    PeerContact deepest{-1, Vec3(), Vec3()};
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contactd& one = result.getContact(i);
      if (one.penetration_depth * radius_ <= deepest.depth) continue;
      deepest.depth = one.penetration_depth * radius_;
      // Its normal points from the first object to the second one.
      deepest.normal = Vec3(one.normal[0], one.normal[1], one.normal[2]);
      deepest.point = centre_ + radius_ * Vec3(one.pos[0], one.pos[1], one.pos[2]);
    }
    return deepest;
  }

 private:
  fcl::Vector3d scaled(const Vec3& v) const {
    const Vec3 unit = (v - centre_) / radius_;
    return {unit.x, unit.y, unit.z};
  }

  Vec3 centre_;
  double radius_;
  fcl::BVHModel<fcl::OBBRSSd> model_;
};

}  // namespace

std::unique_ptr<Peer> make_fcl_mesh(const PeerMesh& mesh) {
  return std::make_unique<FclMesh>(mesh);
}

std::unique_ptr<Peer> make_fcl(const stimuli::ConvexMesh& mesh) {
  return std::make_unique<Fcl>(mesh);
}

}  // namespace palpate::runner::evidence::peers
