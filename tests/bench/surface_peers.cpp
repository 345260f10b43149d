// Closed surfaces beside other people's triangle meshes: whether, and where, the way of a tool goes
// through a concave mesh. Bullet casts a ray, FCL collides a thin capsule; our row is a whole tick
// of the renderer, which asks that several times and gives the force.
//
// Usage: surface_peers [QUERIES]   of each kind; 4000 if not given

#ifndef NDEBUG
#define NDEBUG
#endif
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <vector>

#include "rendering/renderer.h"
#include "runner/evidence/tick_meters.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "stimuli/closed_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::bench {
namespace {

constexpr double kRadius = 0.03, kThin = 1e-8;  // m
constexpr double kWrong = 1e-6;                 // of the size
constexpr double kNone = 2;                     // times: no hit

/// A way from `from` to `to`, and when it first meets the surface.
struct Query {
  Vec3 from, to;
  double time = kNone;
};

/// By every triangle, from either side.
double first_meeting(const stimuli::Surface& surface, const Vec3& from, const Vec3& to) {
  double first = kNone;
  const Vec3 way = to - from;
  for (const stimuli::SurfaceTriangle& t : surface.triangles()) {
    const double a = glm::dot(t.normal, from) - t.offset, b = glm::dot(t.normal, to) - t.offset;
    if ((a > 0) == (b > 0)) continue;
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 v = surface.vertices()[t.corners[k]] - from,
                 w = surface.vertices()[t.corners[(k + 1) % 3]] - from;
      const double side = glm::dot(way, glm::cross(v, w));
      least = std::min(least, side);
      most = std::max(most, side);
    }
    if (least < 0 && most > 0) continue;
    first = std::min(first, a / (a - b));
  }
  return first;
}

struct Row {
  double median = 0, p99 = 0;  // ns
  int wrong = 0, lost = 0;
};

/// \param answer  when the way meets the surface; NaN: at some time
Row time_queries(const std::vector<Query>& queries,
                 const std::function<double(const Query&)>& answer) {
  const double ns = runner::evidence::nanoseconds_per_count();
  std::vector<std::uint64_t> counts;
  Row row;
  for (const Query& query : queries) {
    const std::uint64_t start = runner::evidence::begin_count();
    const double time = answer(query);
    counts.push_back(runner::evidence::end_count() - start);
    const double off = std::abs(time - query.time) * glm::length(query.to - query.from);
    const bool met = !(time > 1), meets = query.time <= 1;
    row.wrong += met != meets || (meets && off > kWrong * 2 * kRadius) ? 1 : 0;
    row.lost += meets && !met ? 1 : 0;
  }
  std::sort(counts.begin(), counts.end());
  row.median = static_cast<double>(counts[counts.size() / 2]) * ns;
  row.p99 = static_cast<double>(counts[counts.size() * 99 / 100]) * ns;
  return row;
}

void print(const char* method, const std::vector<Query>& queries, const Row& row) {
  std::printf("%-28s%9zu%10.2f%10.2f%8d%8d\n", method, queries.size(), row.median / 1e3,
              row.p99 / 1e3, row.wrong, row.lost);
}

/// A ball with bumps and hollows, three tenths of whose edges are concave.
stimuli::PolygonSoup bumpy_ball(int subdivisions) {
  stimuli::PolygonSoup soup = stimuli::icosphere(kRadius, subdivisions);
  for (Vec3& v : soup.vertices) {
    const Vec3 out = v / kRadius;
    v *= 1 + 0.04 * (std::sin(11 * out.x + 1) + std::sin(9 * out.y + 2) * std::cos(8 * out.z));
  }
  return soup;
}

class Bullet {
 public:
  explicit Bullet(const stimuli::Surface& surface) {
    for (const stimuli::SurfaceTriangle& t : surface.triangles())
      mesh_.addTriangle(corner(surface, t, 0), corner(surface, t, 1), corner(surface, t, 2));
    shape_ = std::make_unique<btBvhTriangleMeshShape>(&mesh_, false);
  }
  double cast(const Query& query) const {
    struct First final : btTriangleRaycastCallback {
      First(const btVector3& from, const btVector3& to) : btTriangleRaycastCallback(from, to) {}
      btScalar reportHit(const btVector3&, btScalar fraction, int, int) override {
        time = std::min<double>(time, fraction);
        return fraction;
      }
      double time = kNone;
    } first(to_bullet(query.from), to_bullet(query.to));
    shape_->performRaycast(&first, first.m_from, first.m_to);
    return first.time;
  }

 private:
  // Its tolerances are absolute: the ball has radius 1.
  static btVector3 to_bullet(const Vec3& v) {
    return {v.x / kRadius, v.y / kRadius, v.z / kRadius};
  }
  static btVector3 corner(const stimuli::Surface& surface, const stimuli::SurfaceTriangle& t,
                          std::size_t k) {
    return to_bullet(surface.vertices()[t.corners[k]]);
  }
  btTriangleMesh mesh_;
  std::unique_ptr<btBvhTriangleMeshShape> shape_;
};

class Fcl {
 public:
  explicit Fcl(const stimuli::Surface& surface) {
    std::vector<fcl::Vector3d> vertices;
    std::vector<fcl::Triangle> triangles;
    for (const Vec3& v : surface.vertices()) vertices.emplace_back(to_fcl(v));
    for (const stimuli::SurfaceTriangle& t : surface.triangles())
      triangles.emplace_back(t.corners[0], t.corners[1], t.corners[2]);
    model_.beginModel();
    model_.addSubModel(vertices, triangles);
    model_.endModel();
  }
  double collide(const Query& query) const {
    const fcl::Vector3d from = to_fcl(query.from), way = to_fcl(query.to) - from;
    const fcl::Capsuled capsule(kThin / kRadius, way.norm());
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    pose.linear() =
        Eigen::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitZ(), way).toRotationMatrix();
    pose.translation() = from + 0.5 * way;
    fcl::CollisionResultd result;
    fcl::collide<double>(&model_, fcl::Transform3d::Identity(), &capsule, pose,
                         fcl::CollisionRequestd(), result);
    return result.isCollision() ? std::nan("") : kNone;
  }

 private:
  static fcl::Vector3d to_fcl(const Vec3& v) { return fcl::Vector3d(v.x, v.y, v.z) / kRadius; }
  fcl::BVHModel<fcl::OBBRSSd> model_;
};

void compare(int subdivisions, std::size_t count) {
  const stimuli::PolygonSoup soup = bumpy_ball(subdivisions);
  const std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, stimuli::Material{}}};
  const auto surface = std::make_shared<const stimuli::Surface>(shells);
  const Bullet bullet(*surface);
  const Fcl fcl(*surface);
  for (const bool segment : {false, true}) {
    const rendering::Renderer& renderer =
        segment ? rendering::ray_renderer() : rendering::point_renderer();
    const rendering::Scene scene({}, segment, {}, nullptr, {{surface, Pose{}, 0}});
    rendering::RenderState state = scene.initial_state();
    runner::evidence::SurfaceStrokeSettings settings;
    settings.side = segment;
    settings.radius = surface->radius();
    runner::evidence::SurfaceStroke hand(settings);
    // Ways of the tip from the ideal to the virtual tool, or of the stylus from tip to tail; every
    // second one outside.
    std::vector<Query> queries;
    std::vector<std::uint64_t> ours;
    double depth = 0;
    while (queries.size() < count) {
      const rendering::LineProbe probe = hand.next(depth);
      const std::uint64_t start = runner::evidence::begin_count();
      const rendering::Rendering r = renderer.tick(scene, state, probe, 1e-3);
      const std::uint64_t cost = runner::evidence::end_count() - start;
      depth = r.deepest.depth;
      if (r.contacts == 0) continue;
      ours.push_back(cost);
      const Vec3 off = 1e-6 * r.deepest.normal;
      if (segment) {
        if (queries.size() % 2 == 0)
          queries.push_back({probe.tip, probe.tail});
        else
          queries.push_back({r.ideal.tip + off, r.ideal.tail + off});
      } else {
        const Vec3 out = r.ideal.tip + off;
        queries.push_back({out, queries.size() % 2 == 0 ? probe.tip : 2.0 * out - probe.tip});
      }
    }
    for (Query& query : queries) query.time = first_meeting(*surface, query.from, query.to);
    const auto met = std::count_if(queries.begin(), queries.end(),
                                   [](const Query& query) { return query.time <= 1; });
    std::printf("\n%zu triangles, %s; %td of %zu ways meet the surface\n%-28s%9s%10s%10s%8s%8s\n",
                surface->triangles().size(), segment ? "segment of 0.12 m" : "way of a point", met,
                queries.size(), "", "queries", "median us", "p99 us", "wrong", "lost");
    print("Bullet, ray on BVH", queries,
          time_queries(queries, [&](const Query& query) { return bullet.cast(query); }));
    print("FCL, capsule on OBBRSS", queries, time_queries(queries, [&](const Query& query) {
            const double time = fcl.collide(query);
            return std::isnan(time) && query.time <= 1 ? query.time : time;
          }));
    std::sort(ours.begin(), ours.end());
    const double ns = runner::evidence::nanoseconds_per_count();
    std::printf("%-28s%9zu%10.2f%10.2f\n",
                segment ? "palpate, a tick of the ray" : "palpate, a tick of the point",
                ours.size(), static_cast<double>(ours[ours.size() / 2]) * ns / 1e3,
                static_cast<double>(ours[ours.size() * 99 / 100]) * ns / 1e3);
  }
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  const int count = argc == 2 ? std::atoi(argv[1]) : 4000;
  if (argc > 2 || count < 1) {
    std::fprintf(stderr, "usage: surface_peers [QUERIES]\n");
    return 2;
  }
  for (const int subdivisions : {3, 6})
    palpate::bench::compare(subdivisions, static_cast<std::size_t>(count));
  return 0;
}
