// The starts of walks over a large mesh: near the sought place on any shape, and without effect on
// anything but time.

#include "rendering/facet_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <set>
#include <vector>

#include "rendering/near_pairs.h"
#include "rendering/renderer.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_mesh.h"

namespace palpate::rendering {
namespace {

using testing::uniform;
using Kind = ContactFeature::Kind;
using Mesh = std::shared_ptr<const stimuli::ConvexMesh>;

constexpr double kRadius = 0.03;  // m

Mesh stretched_ball(const Vec3& by, int subdivisions) {
  stimuli::PolygonSoup soup = stimuli::icosphere(kRadius, subdivisions);
  for (Vec3& vertex : soup.vertices) vertex *= by;
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

/// Round, flat, long, and all three at once.
const Vec3 kStretches[] = {Vec3(1), Vec3(1, 1, 0.05), Vec3(1, 0.05, 0.05), Vec3(1, 0.3, 0.1)};

/// By definition, the facet whose plane a ray from the inside meets first.
std::uint32_t exit_facet(const stimuli::ConvexMesh& mesh, const Vec3& from, const Vec3& along) {
  std::uint32_t first = 0;
  double earliest = HUGE_VAL;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const stimuli::Facet& facet = mesh.facets()[f];
    const double rate = glm::dot(facet.normal, along);
    if (rate <= 0) continue;
    const double time = (facet.offset - glm::dot(facet.normal, from)) / rate;
    if (time < earliest) {
      earliest = time;
      first = f;
    }
  }
  return first;
}

/// Steps over sides from one facet to the other; `most` + 1 if there are more.
int steps_between(const stimuli::ConvexMesh& mesh, std::uint32_t from, std::uint32_t to, int most) {
  std::set<std::uint32_t> reached{from};
  for (int steps = 0; steps <= most; ++steps) {
    if (reached.count(to) > 0) return steps;
    std::set<std::uint32_t> next = reached;
    for (const std::uint32_t f : reached) {
      const stimuli::Facet& facet = mesh.facets()[f];
      for (std::uint32_t i = 0; i < facet.side_count; ++i)
        next.insert(mesh.sides()[facet.first_side + i].across);
    }
    reached = std::move(next);
  }
  return most + 1;
}

TEST(FacetMap, IsNearTheRaysExitOnAnyShape) {
  constexpr int kNear = 12;  // facets
  for (const Vec3& by : kStretches) {
    for (const int subdivisions : {3, 5}) {
      const Mesh mesh = stretched_ball(by, subdivisions);
      const FacetMap map(*mesh, 0);
      constexpr std::uint64_t kSeed = 7;
      Random random(kSeed);
      double sum = 0;
      constexpr int kRays = 200;
      for (int i = 0; i < kRays; ++i) {
        // Sample the surface, not directions: most directions meet a plate in its middle.
        const Vec3 at = by * testing::random_direction(random);
        const std::uint32_t exit = exit_facet(*mesh, Vec3(0), at);
        const int steps = steps_between(*mesh, map.facet_under(kRadius * at), exit, kNear);
        ASSERT_LE(steps, kNear) << "stretched by " << by.y << ", " << by.z << ", ray " << i;
        sum += steps;
      }
      EXPECT_LE(sum / kRays, 3) << "stretched by " << by.y << ", " << by.z;
    }
  }
}

TEST(FacetMap, LiesUnderTheSegmentsNearestPoint) {
  const Mesh mesh = stretched_ball(Vec3(1), 5);
  const FacetMap map(*mesh, 0);
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  for (int i = 0; i < 300; ++i) {
    const Vec3 out = testing::random_direction(random);
    const Vec3 along = glm::normalize(glm::cross(out, testing::random_direction(random)));
    const Vec3 tip = 1.1 * kRadius * out - uniform(random, 0, 0.12) * along;
    const stimuli::Facet& under = mesh->facets()[map.facet_under(tip, 0.12 * along)];
    // For a ball to which the segment is a tangent.
    EXPECT_GT(glm::dot(under.normal, out), std::cos(0.06));
  }
}

TEST(FacetMap, AnInvalidDirectionGivesAnyFacet) {
  const Mesh mesh = stretched_ball(Vec3(1), 5);
  const FacetMap map(*mesh, 0);
  for (const double bad : {HUGE_VAL, -HUGE_VAL, 1e308, std::nan("")}) {
    for (const Vec3& p : {Vec3(bad, 0.01, 0), Vec3(0.01, bad, bad), Vec3(bad)})
      EXPECT_LT(map.facet_under(p, Vec3(bad, 0, 1)), mesh->facets().size());
  }
}

TEST(FacetMap, SmallMeshesHaveNone) {
  const ContactTrees small(*stretched_ball(Vec3(1), 3), true);
  EXPECT_EQ(small.facet_map(), nullptr);
  const ContactTrees large(*stretched_ball(Vec3(1), 5), true);
  EXPECT_NE(large.facet_map(), nullptr);
}

TEST(SupportMap, ClimbsFromItEndOnTheExtremeVertex) {
  std::vector<Mesh> meshes;
  for (const Vec3& by : kStretches) meshes.push_back(stretched_ball(by, 4));
  meshes.push_back(std::make_shared<const stimuli::ConvexMesh>(
      stimuli::cylinder(kRadius, 0.06, 700)));  // caps of coplanar faces
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, {21});
    meshes.push_back(
        std::make_shared<const stimuli::ConvexMesh>(testing::random_convex_mesh(random)));
  }
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  for (const Mesh& mesh : meshes) {
    const stimuli::SupportMap map(*mesh, 0);
    for (int i = 0; i < 50; ++i) {
      const Vec3 n = testing::random_direction(random);
      double highest = -HUGE_VAL;
      for (const Vec3& v : mesh->vertices()) highest = std::max(highest, glm::dot(n, v));
      const std::uint32_t found = stimuli::support_vertex(*mesh, n, map.near_support(n));
      EXPECT_GE(glm::dot(n, mesh->vertices()[found]), highest - 1e-15 * mesh->size());
    }
  }
}

TEST(PairCast, WithoutStartIsInsideUnlessAPlaneSeparates) {
  int inside = 0, outside = 0;
  for (const Vec3& by : kStretches) {
    const Mesh mesh = stretched_ball(by, 5);
    const ContactTrees trees(*mesh, true);
    std::uint64_t scans = 0;
    const CastMesh part{*mesh, trees, testing::middle_of(*mesh), scans};
    constexpr std::uint64_t kSeed = 10;
    Random random(kSeed);
    for (int i = 0; i < 60; ++i) {
      const Vec3 at =
          uniform(random, 0.95, 1.05) * kRadius * by * testing::random_direction(random);
      const Vec3 d = i % 3 == 0 ? Vec3(0) : 0.1 * testing::random_direction(random);
      const Vec3 tip = at - random.unit() * d;
      const double depth = i % 3 == 0 ? nearest_feature_point(*mesh, tip).depth
                                      : nearest_feature_segment(*mesh, tip, d).depth;
      if (std::abs(depth) < 1e-12) continue;
      const WalkResult located = locate(part, {}, tip, d);
      ++(depth < 0 ? outside : inside);
      EXPECT_EQ(located.feature.kind != Kind::none, depth > 0) << "depth " << depth;
    }
  }
  EXPECT_GT(inside, 30);
  EXPECT_GT(outside, 30);
}

bool same_bits(const Rendering& a, const Rendering& b) {
  return a.force == b.force && a.torque == b.torque && a.ideal.tip == b.ideal.tip &&
         a.ideal.tail == b.ideal.tail && a.deepest.point == b.deepest.point &&
         a.deepest.normal == b.deepest.normal && a.deepest.depth == b.deepest.depth &&
         a.deepest.type == b.deepest.type && a.contacts == b.contacts && a.faults == b.faults;
}

/// The same path over one mesh with maps and without.
class WithAndWithoutMaps {
 public:
  WithAndWithoutMaps(const Renderer& renderer, const Mesh& mesh) : renderer_(renderer) {
    for (const std::size_t small_mesh : {std::size_t{0}, SIZE_MAX}) {
      SceneObject object;
      object.mesh = mesh;
      object.trees =
          std::make_shared<const ContactTrees>(*mesh, true, ContactTrees::kScanLimit, small_mesh);
      scenes_.emplace_back(std::vector<SceneObject>{object});
      states_.push_back(scenes_.back().initial_state());
    }
  }

  void begin() {
    for (std::size_t i = 0; i < 2; ++i) states_[i] = scenes_[i].initial_state();
  }

  /// Whether the tick is the same, to the bit.
  bool tick(const LineProbe& probe) {
    const Rendering with = renderer_.tick(scenes_[0], states_[0], probe, 1e-3);
    const Rendering without = renderer_.tick(scenes_[1], states_[1], probe, 1e-3);
    touching_ = without.contacts > 0;
    return same_bits(with, without);
  }
  bool touching() const { return touching_; }

 private:
  const Renderer& renderer_;
  std::vector<Scene> scenes_;
  std::vector<RenderState> states_;
  bool touching_ = false;
};

class Maps : public ::testing::TestWithParam<const Renderer*> {};

TEST_P(Maps, ChangeNoBitOfLargeMeshFirstContacts) {
  int contacts = 0;
  for (const Vec3& by : kStretches) {
    WithAndWithoutMaps both(*GetParam(), stretched_ball(by, 5));
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      Random random(seed, {22});
      both.begin();
      const Vec3 to = uniform(random, 0, 0.9) * kRadius * by * testing::random_direction(random);
      const Vec3 out = testing::random_direction(random), drift = testing::random_direction(random);
      const Vec3 axis = testing::random_direction(random), turn = testing::random_direction(random);
      const double share = seed % 2 == 0 ? 0 : random.unit();
      const double step = 1e-4 * std::pow(50, random.unit());
      double height = 0.05;
      for (int t = 0; t < 600 && height > -step; ++t, height -= step) {
        const Vec3 at = to + height * (out + 0.3 * drift);
        const LineProbe probe =
            testing::probe_at(at, glm::normalize(axis + 5 * height * turn), 0.12, share);
        ASSERT_TRUE(both.tick(probe)) << "seed " << seed << " tick " << t;
        contacts += both.touching();
      }
    }
  }
  EXPECT_GT(contacts, 1000);
}

TEST_P(Maps, ChangeNoBitOnAnySolid) {
  int contacts = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed, {23});
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(testing::random_convex_mesh(random));
    WithAndWithoutMaps both(*GetParam(), mesh);
    const double length = mesh->size() * uniform(random, 0, 3);
    for (const LineProbe& probe : testing::wandering_path(random, *mesh, length, 150, 0.02)) {
      ASSERT_TRUE(both.tick(probe)) << "seed " << seed;
      contacts += both.touching();
    }
  }
  EXPECT_GT(contacts, 1000);
}

INSTANTIATE_TEST_SUITE_P(Both, Maps, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
