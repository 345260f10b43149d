// Parts that do not cover their solid, or cover it twice, are found.

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_names.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::stimuli {
namespace {
namespace covers {

PolygonSoup box_at(const Vec3& centre, const Vec3& size) {
  PolygonSoup soup = box(size);
  for (Vec3& vertex : soup.vertices) vertex += centre;
  return soup;
}

TriangleSurface surface_of(const PolygonSoup& soup) {
  TriangleSurface surface;
  for (const auto& face : soup.faces) {
    for (std::size_t k = 2; k < face.size(); ++k)
      surface.push_back(
          {soup.vertices[face[0]], soup.vertices[face[k - 1]], soup.vertices[face[k]]});
  }
  return surface;
}

/// The faults of these boxes as parts of a cube of 0.1 m.
std::string found(const std::vector<PolygonSoup>& boxes, double slack = 0) {
  std::vector<ConvexMesh> parts;
  for (const PolygonSoup& soup : boxes) parts.emplace_back(soup);
  MeshFaults faults;
  check_cover(surface_of(cube(0.1)), parts, slack, faults);
  try {
    faults.throw_if_any();
  } catch (const MeshError& error) {
    return error.what();
  }
  return "";
}

TEST(CoverCheck, HalvesOfACubeCoverIt) {
  const PolygonSoup left = box_at({-0.025, 0, 0}, {0.05, 0.1, 0.1}),
                    right = box_at({0.025, 0, 0}, {0.05, 0.1, 0.1});
  EXPECT_EQ(found({left, right}), "");
  EXPECT_EQ(found({cube(0.1)}), "");
}

TEST(CoverCheck, VolumeRevealsGapsAndOverlaps) {
  const PolygonSoup left = box_at({-0.025, 0, 0}, {0.05, 0.1, 0.1});
  for (const double shorter : {1e-6, -1e-6}) {
    const std::string fault =
        found({left, box_at({0.025, 0, 0}, {0.05, 0.1, 0.1 - shorter})}, 1e-12);
    EXPECT_NE(fault.find("expected convex parts of 0.001 m^3 in all"), std::string::npos) << fault;
    EXPECT_NE(fault.find("in 2 parts"), std::string::npos) << fault;
  }
  // Accepted if corners may be off by that much.
  EXPECT_EQ(found({left, box_at({0.025, 0, 0}, {0.05, 0.1, 0.1 - 1e-9})}, 1e-8), "");
}

TEST(CoverCheck, PointsRevealRightVolumesAtTheWrongPlace) {
  // Half of the points are in both parts, half in neither.
  const std::string twice =
      found({box_at({-0.025, 0, 0}, {0.05, 0.1, 0.1}), box_at({-0.025, 0, 0}, {0.05, 0.1, 0.1})});
  EXPECT_NE(twice.find("of the convex parts, but the surface winds round it 1.00 times"),
            std::string::npos)
      << twice;
  const std::string none =
      found({box_at({-0.025, 0, 0}, {0.05, 0.1, 0.1}), box_at({0.5, 0, 0}, {0.05, 0.1, 0.1})});
  EXPECT_NE(none.find("lies in 0 of the convex parts, but the surface winds round it 1.00 times"),
            std::string::npos)
      << none;
  // A tenth of the cube at the wrong place, too.
  const std::string tenth =
      found({box_at({0.005, 0, 0}, {0.09, 0.1, 0.1}), box_at({0.045, 0, 0}, {0.01, 0.1, 0.1})});
  EXPECT_NE(tenth.find("lies in"), std::string::npos) << tenth;
}

}  // namespace covers
}  // namespace
}  // namespace palpate::stimuli
