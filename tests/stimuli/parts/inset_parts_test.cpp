// Insets of concave solids, against distances to their true surface.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "data/base/random.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/face_triangles.h"
#include "stimuli/inset.h"
#include "stimuli/parts/triangle_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/stimuli/concave_solids.h"

namespace palpate::stimuli {
namespace {

using MeshPointer = std::shared_ptr<const ConvexMesh>;

bool holds(const std::vector<MeshPointer>& meshes, const Vec3& p, double slack) {
  return std::any_of(meshes.begin(), meshes.end(), [&](const MeshPointer& mesh) {
    return std::all_of(mesh->facets().begin(), mesh->facets().end(), [&](const Facet& facet) {
      return glm::dot(facet.normal, p) <= facet.offset + slack;
    });
  });
}

Vec3 nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 d = b - a;
  return a + std::clamp(glm::dot(p - a, d) / glm::dot(d, d), 0.0, 1.0) * d;
}

/// The true surface, as triangles of its polygons.
class Surface {
 public:
  explicit Surface(const PolygonSoup& soup) {
    for (const auto& face : soup.faces) {
      std::vector<Vec3> corners;
      for (const std::uint32_t v : face) corners.push_back(soup.vertices[v]);
      for (const auto& [a, b, c] : face_triangles(corners))
        triangles_.push_back({corners[a], corners[b], corners[c]});
    }
  }

  struct Nearest {
    double distance = std::numeric_limits<double>::infinity();
    bool on_face = false;  ///< perpendicular to a plane of the surface, not at an edge
  };
  Nearest nearest(const Vec3& p) const {
    Nearest out;
    for (const auto& t : triangles_) {
      const Vec3 n = glm::normalize(glm::cross(t[1] - t[0], t[2] - t[0]));
      const Vec3 foot = p - glm::dot(n, p - t[0]) * n;
      bool in = true;
      for (int k = 0; k < 3; ++k)
        in &= glm::dot(glm::cross(n, t[(k + 1) % 3] - t[k]), foot - t[k]) >= 0;
      Vec3 at = foot;
      if (!in) {
        at = nearest_on_segment(t[0], t[1], p);
        for (int k = 1; k < 3; ++k) {
          const Vec3 other = nearest_on_segment(t[k], t[(k + 1) % 3], p);
          if (glm::distance(other, p) < glm::distance(at, p)) at = other;
        }
      }
      const double distance = glm::distance(at, p);
      if (distance < out.distance - 1e-12) out = {distance, in};
      if (distance < out.distance + 1e-12) out.on_face |= in;
    }
    return out;
  }

 private:
  TriangleSurface triangles_;
};

struct LayerPoints {
  int in = 0, out = 0, round = 0;  // points in the layer, outside it, and where either is right
};

/// Random points of the solid: points in the layer are at least as deep as the inset, and deeper
/// points are in the layer: exactly under faces, within kInsetWithin under concave edges.
LayerPoints compare(const solids::Solid& solid, const std::vector<MeshPointer>& parts, double depth,
                    int points) {
  const Surface surface(solid.soup);
  double size = 0;
  Vec3 low(1e9), high(-1e9);
  for (const Vec3& v : solid.soup.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  size = glm::length(high - low);
  const std::vector<MeshPointer> layer = inset_union(parts, depth);
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  LayerPoints counts;
  while (counts.in + counts.out + counts.round < points) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = low[k] + random.unit() * (high[k] - low[k]);
    if (solid.holds ? !solid.holds(p) : !holds(parts, p, 0)) continue;
    const Surface::Nearest nearest = surface.nearest(p);
    if (std::abs(nearest.distance - depth) < 4e-6 * size) continue;
    const bool in = holds(layer, p, 0);
    if (in) {
      EXPECT_GT(nearest.distance, depth) << p.x << ' ' << p.y << ' ' << p.z;
      ++counts.in;
    } else if (nearest.distance > depth && !nearest.on_face &&
               nearest.distance < kInsetWithin * depth) {
      ++counts.round;
    } else {
      EXPECT_LT(nearest.distance, depth)
          << p.x << ' ' << p.y << ' ' << p.z << (nearest.on_face ? " under a face" : "");
      ++counts.out;
    }
  }
  return counts;
}

std::vector<MeshPointer> pointers(const std::vector<PolygonSoup>& soups) {
  std::vector<MeshPointer> out;
  for (const PolygonSoup& soup : soups) out.push_back(std::make_shared<const ConvexMesh>(soup));
  return out;
}

TEST(InsetUnion, AbuttingPartsHoldTheDeeperPoints) {
  const auto compare_slabs = [](const solids::Outline& outline, double height, double depth) {
    return compare(solids::prism(outline, height), pointers(solids::slabs(outline, height)), depth,
                   3000);
  };
  for (const double depth : {0.0005, 0.002, 0.005}) {
    const LayerPoints l = compare_slabs(solids::kL, 0.03, depth);
    EXPECT_GT(l.in, 500);
    EXPECT_LT(l.round, 0.01 * (l.in + l.out));
    compare_slabs(solids::kU, 0.03, depth);
    compare_slabs(solids::stair_outline(4), 0.05, depth);
    compare_slabs(solids::kPlus, 2, 50 * depth);
  }
}

TEST(InsetUnion, TorusStaysATorus) {
  for (const double depth : {0.001, 0.004}) {
    const LayerPoints counts =
        compare(solids::torus(0.03, 0.01, 12, 8),
                pointers(solids::torus_sections(0.03, 0.01, 12, 8)), depth, 1500);
    EXPECT_GT(counts.in, 100);
  }
}

PolygonSoup box(const Vec3& low, const Vec3& high) {
  PolygonSoup soup = cube(1);
  for (Vec3& v : soup.vertices) v = 0.5 * (low + high) + v * (high - low);
  return soup;
}

TEST(InsetUnion, OverlappingOrAbuttingPartsAreOneSolid) {
  const solids::Solid l = solids::l_shape();
  const std::vector<std::vector<PolygonSoup>> ways{
      {box({0, 0, 0}, {0.02, 0.06, 0.03}), box({0.02, 0, 0}, {0.06, 0.02, 0.03})},
      {box({0, 0, 0}, {0.02, 0.06, 0.03}), box({0, 0, 0}, {0.06, 0.02, 0.03})},
      {box({0, 0, 0}, {0.02, 0.06, 0.03}), box({0.01, 0, 0}, {0.06, 0.02, 0.03})},
      {box({0, 0.02, 0}, {0.02, 0.06, 0.03}), box({0, 0, 0}, {0.03, 0.02, 0.03}),
       box({0.03, 0, 0}, {0.06, 0.02, 0.03})}};
  for (std::size_t w = 0; w < ways.size(); ++w) {
    SCOPED_TRACE(w);
    std::vector<MeshPointer> parts;
    for (const PolygonSoup& soup : ways[w]) parts.push_back(std::make_shared<ConvexMesh>(soup));
    EXPECT_GT(compare(l, parts, 0.003, 2000).in, 500);
    std::reverse(parts.begin(), parts.end());
    EXPECT_GT(compare(l, parts, 0.003, 2000).in, 500);
  }
}

TEST(InsetUnion, CutBoxEqualsTheWholeBox) {
  const auto whole = std::make_shared<const ConvexMesh>(box({-0.03, -0.02, 0}, {0.03, 0.02, 0.03}));
  const std::vector<MeshPointer> halves{
      std::make_shared<const ConvexMesh>(box({-0.03, -0.02, 0}, {0.004, 0.02, 0.03})),
      std::make_shared<const ConvexMesh>(box({0.004, -0.02, 0}, {0.03, 0.02, 0.03}))};
  const auto one = inset_union({whole}, 0.004), two = inset_union(halves, 0.004);
  ASSERT_EQ(one.size(), 1u);
  ASSERT_EQ(two.size(), 1u) << "both halves grow to the whole";
  ASSERT_EQ(two[0]->vertices().size(), 8u);
  for (const Vec3& v : two[0]->vertices()) EXPECT_TRUE(holds(one, v, 1e-12));
  for (const Vec3& v : one[0]->vertices()) EXPECT_TRUE(holds(two, v, 1e-12));
}

TEST(InsetUnion, SeparatePartsAreInsetSeparately) {
  const std::vector<MeshPointer> apart{
      std::make_shared<const ConvexMesh>(box({0, 0, 0}, {0.02, 0.02, 0.02})),
      std::make_shared<const ConvexMesh>(box({0.0201, 0, 0}, {0.05, 0.02, 0.02}))};
  const auto layer = inset_union(apart, 0.004);
  ASSERT_EQ(layer.size(), 2u);
  EXPECT_FALSE(holds(layer, {0.019, 0.01, 0.01}, 0));
  EXPECT_TRUE(holds(layer, {0.0159, 0.01, 0.01}, 0));
  EXPECT_TRUE(inset_union(apart, 0.0101).empty());
}

TEST(InsetUnion, ThreeConcaveEdgesCornerIsDeepOrRefused) {
  // A cube without one of its eight octants.
  const std::vector<PolygonSoup> soups{box({-0.03, -0.03, -0.03}, {0.03, 0.03, 0}),
                                       box({-0.03, -0.03, 0}, {0, 0.03, 0.03}),
                                       box({0, -0.03, 0}, {0.03, 0, 0.03})};
  std::vector<MeshPointer> parts;
  for (const PolygonSoup& soup : soups) parts.push_back(std::make_shared<ConvexMesh>(soup));
  std::vector<MeshPointer> layer;
  try {
    layer = inset_union(parts, 0.004);
  } catch (const MeshError& error) {
    EXPECT_NE(error.faults()[0].find("expected"), std::string::npos);
    return;
  }
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = -0.01 * random.unit();
    const double out = -std::max({p.x, p.y, p.z});
    const Vec3 beyond(std::max(0.0, -p.x), std::max(0.0, -p.y), std::max(0.0, -p.z));
    const double distance = glm::length(beyond);  // from the missing octant
    EXPECT_GE(distance, out);
    if (distance > kInsetWithin * 1.02 * 0.004) {
      EXPECT_TRUE(holds(layer, p, 1e-9));
    } else if (distance < 0.004 - 1e-6) {
      EXPECT_FALSE(holds(layer, p, 0));
    }
  }
}

}  // namespace
}  // namespace palpate::stimuli
