// Common volumes of convex parts, against sampled points and known boxes.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/temporary_folder.h"
#include "tests/stimuli/part_checks.h"

namespace palpate::stimuli {
namespace {

ConvexMesh box_at(const Vec3& low, const Vec3& high, const Quat& turn = Quat(1, 0, 0, 0)) {
  PolygonSoup soup = cube(1);
  for (Vec3& v : soup.vertices) v = turn * (0.5 * (low + high) + v * (high - low));
  return ConvexMesh(soup);
}

TEST(CommonVolume, IsExactForOverlappingAbuttingAndSeparateBoxes) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 20; ++i) {
    const Quat turn = i == 0 ? Quat(1, 0, 0, 0) : uniform_rotation(random);
    const ConvexMesh one = box_at(Vec3(0), Vec3(0.02, 0.03, 0.04), turn);
    const auto with = [&](const Vec3& low, const Vec3& high) {
      const ConvexMesh other = box_at(low, high, turn);
      EXPECT_NEAR(common_volume(one, other), common_volume(other, one), 1e-18);
      return common_volume(one, other);
    };
    EXPECT_NEAR(with(Vec3(0.01), Vec3(0.05)), 0.01 * 0.02 * 0.03, 1e-17);
    EXPECT_NEAR(with(Vec3(0.005), Vec3(0.01)), 0.005 * 0.005 * 0.005, 1e-18);  // within
    // Faces in common, from inside and from outside.
    EXPECT_NEAR(with(Vec3(0), Vec3(0.02, 0.03, 0.04)), 0.02 * 0.03 * 0.04, 1e-17);
    EXPECT_NEAR(with(Vec3(0), Vec3(0.01, 0.03, 0.04)), 0.01 * 0.03 * 0.04, 1e-17);
    EXPECT_NEAR(with(Vec3(0.02, 0, 0), Vec3(0.04, 0.03, 0.04)), 0, 1e-17);
    EXPECT_NEAR(with(Vec3(0.02, 0.01, -0.01), Vec3(0.04, 0.05, 0.02)), 0, 1e-17);
    EXPECT_EQ(with(Vec3(0.06), Vec3(0.08)), 0);
  }
}

TEST(CommonVolume, SolidsInAnyOrientationMatchSampledPoints) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  for (int i = 0; i < 30; ++i) {
    const Vec3 half(0.03, 0.02, 0.04);
    const ConvexMesh a = box_at(-half, half, uniform_rotation(random));
    PolygonSoup moved = i % 2 == 0 ? cylinder(0.02, 0.06, 7) : icosphere(0.03, 1);
    const Quat turn = uniform_rotation(random);
    const Vec3 by(0.04 * random.unit(), 0.01, 0);
    for (Vec3& v : moved.vertices) v = turn * v + by;
    const ConvexMesh b(moved);
    int in_a = 0, in_both = 0;
    for (int k = 0; k < 20000; ++k) {
      const Vec3 p = a.centre() + a.radius() * Vec3(2 * random.unit() - 1, 2 * random.unit() - 1,
                                                    2 * random.unit() - 1);
      if (checks::out_of(a, p) > 0) continue;
      ++in_a;
      in_both += checks::out_of(b, p) <= 0;
    }
    const double share = static_cast<double>(in_both) / in_a;
    EXPECT_NEAR(common_volume(a, b) / checks::volume(a), share, 0.025) << i;
  }
}

/// Of a file of cubes in a row, each a group. \param places  m, of their centres
std::vector<std::string> overlaps_of_cubes(const std::vector<double>& places) {
  const testing::TemporaryFolder folder;
  ObjectSpec spec;
  spec.shape = ShapeKind::mesh;
  spec.file = folder / "cubes.obj";
  std::ofstream file(spec.file);
  for (std::size_t b = 0; b < places.size(); ++b) {
    file << "g box" << b << "\n";
    const PolygonSoup box = cube(0.02);
    for (const Vec3& v : box.vertices)
      file << "v " << v.x + places[b] << ' ' << v.y << ' ' << v.z << '\n';
    for (const auto& face : box.faces) {
      file << 'f';
      for (const std::uint32_t corner : face) file << ' ' << 8 * b + corner + 1;
      file << '\n';
    }
  }
  file.close();
  return group_overlaps(spec);
}

TEST(GroupOverlaps, NameTheGroupsAndHowMuch) {
  EXPECT_EQ(overlaps_of_cubes({0, 0.015}),
            std::vector<std::string>{"group 'box0' and group 'box1' overlap by 2e-06 m^3, 25 % of "
                                     "group 'box0'; they are touched as one object"});
  EXPECT_TRUE(overlaps_of_cubes({0, 0.02}).empty());
  EXPECT_TRUE(overlaps_of_cubes({0, 0.03}).empty());
}

TEST(GroupOverlaps, NamesTheLargestOfMany) {
  const std::vector<std::string> said =
      overlaps_of_cubes({0, 0.019, 0.037, 0.054, 0.07, 0.085, 0.104});
  ASSERT_EQ(said.size(), 4U);
  EXPECT_TRUE(said[0].starts_with("group 'box4' and group 'box5' overlap by 2e-06 m^3, 25 %"));
  EXPECT_TRUE(said[1].starts_with("group 'box3' and group 'box4' overlap by 1.6e-06 m^3, 20 %"));
  EXPECT_TRUE(said[2].starts_with("group 'box2' and group 'box3' overlap by 1.2e-06 m^3, 15 %"));
  EXPECT_EQ(said[3], "3 more pairs of groups overlap, by at most 10 %");
}

}  // namespace
}  // namespace palpate::stimuli
