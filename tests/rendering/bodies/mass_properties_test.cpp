#include "stimuli/surfaces/mass_properties.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <vector>

#include "data/base/random.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "tests/rendering/bodies/body_fixtures.h"
#include "tests/stimuli/concave_solids.h"

namespace palpate::rendering::test {
namespace {

stimuli::MassProperties whole(const Mesh& mesh, const Pose& pose = {}, double density = 1000) {
  const stimuli::PlacedMesh part{mesh.get(), pose};
  return stimuli::with_density(stimuli::moments_of_union({&part, 1}), density);
}

void expect_matrix(const Mat3& found, const Mat3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[i][k], expected[i][k], tolerance) << i << k;
  }
}

TEST(MassProperties, BoxIsAsInTheTextbook) {
  const Vec3 size(0.1, 0.2, 0.05);
  const stimuli::MassProperties p = whole(box_mesh(size));
  const double mass = 1000 * 0.1 * 0.2 * 0.05;
  EXPECT_NEAR(p.mass, mass, 1e-14);
  EXPECT_NEAR(glm::length(p.centre), 0, 1e-16);
  const Vec3 s2 = size * size;
  expect_matrix(p.inertia,
                mass / 12 * Mat3(s2.y + s2.z, 0, 0, 0, s2.x + s2.z, 0, 0, 0, s2.x + s2.y), 1e-16);
}

TEST(MassProperties, SphereErrorFallsWithSquareOfTheEdge) {
  const double r = 0.03;
  const double volume = 4.0 / 3 * std::numbers::pi * r * r * r;
  double last = 0;
  for (int n = 2; n < 5; ++n) {
    const stimuli::MassProperties p = whole(mesh_of(stimuli::icosphere(r, n)));
    const double error = 1 - p.mass / (1000 * volume);
    EXPECT_GT(error, 0);  // inscribed
    EXPECT_NEAR(p.inertia[0][0] / (0.4 * p.mass * r * r), 1, 2.2 * error);
    EXPECT_NEAR(p.inertia[0][1], 0, 1e-12 * p.mass);
    if (last > 0) {
      EXPECT_NEAR(last / error, 4, 0.1);
    }
    last = error;
  }
}

TEST(MassProperties, AreTheSameFarAwayAndTurned) {
  const Mesh mesh = box_mesh({0.1, 0.2, 0.05});
  const Quat q = glm::normalize(Quat(0.3, 0.4, -0.5, 0.7));
  const stimuli::MassProperties here = whole(mesh), there = whole(mesh, {{300, -200, 100}, q});
  EXPECT_NEAR(there.mass, here.mass, 1e-12 * here.mass);
  EXPECT_NEAR(glm::distance(there.centre, Vec3(300, -200, 100)), 0, 1e-12);
  const Mat3 axes = glm::mat3_cast(q);
  expect_matrix(there.inertia, axes * here.inertia * glm::transpose(axes),
                1e-12 * here.inertia[0][0]);
}

/// A cube cut into parts, overlapping itself or covered by itself has the cube's properties.
TEST(MassProperties, RegionsOfSeveralPartsCountOnce) {
  const Mesh cube = box_mesh(Vec3(0.1)), slab = box_mesh({0.06, 0.1, 0.1});
  const stimuli::MassProperties expected = whole(cube);
  const std::vector<std::vector<stimuli::PlacedMesh>> covers = {
      {{cube.get(), {}}, {cube.get(), {}}},
      {{slab.get(), {{-0.02, 0, 0}, {1, 0, 0, 0}}}, {slab.get(), {{0.02, 0, 0}, {1, 0, 0, 0}}}},
  };
  for (std::size_t i = 0; i < covers.size(); ++i) {
    const stimuli::MassProperties p =
        stimuli::with_density(stimuli::moments_of_union(covers[i]), 1000);
    EXPECT_NEAR(p.mass, expected.mass, 1e-13) << i;
    EXPECT_NEAR(glm::length(p.centre), 0, 1e-14) << i;
    expect_matrix(p.inertia, expected.inertia, 1e-15);
  }
  const Mesh half = box_mesh({0.05, 0.1, 0.1}), inner = box_mesh(Vec3(0.03));
  const std::vector<stimuli::PlacedMesh> abut = {
      {half.get(), {{-0.025, 0, 0}, {1, 0, 0, 0}}},
      {half.get(), {{0.025, 0, 0}, {1, 0, 0, 0}}},
      {inner.get(), {{0.01, 0.005, 0}, glm::normalize(Quat(1, 0.2, 0.3, 0.1))}}};
  const stimuli::MassProperties p = stimuli::with_density(stimuli::moments_of_union(abut), 1000);
  EXPECT_NEAR(p.mass, expected.mass, 1e-13);
  expect_matrix(p.inertia, expected.inertia, 1e-15);
}

/// Against points of a grid, for crossed boxes, one of them turned.
TEST(MassProperties, UnionOfTurnedBoxesAgreesWithCounting) {
  const Vec3 size_a(0.1, 0.04, 0.06), size_b(0.05, 0.09, 0.03);
  const Mesh a = box_mesh(size_a), b = box_mesh(size_b);
  const Pose pose_b{{0.02, 0.015, 0.01}, glm::normalize(Quat(1, 0.3, -0.2, 0.4))};
  const std::vector<stimuli::PlacedMesh> parts = {{a.get(), {}}, {b.get(), pose_b}};
  const stimuli::VolumeMoments m = stimuli::moments_of_union(parts);
  const auto inside = [](const Vec3& p, const Vec3& size) {
    return std::abs(p.x) < size.x / 2 && std::abs(p.y) < size.y / 2 && std::abs(p.z) < size.z / 2;
  };
  const int n = 160;
  const double edge = 0.16, h = edge / n;
  double volume = 0;
  Vec3 first(0);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      for (int l = 0; l < n; ++l) {
        const Vec3 p = Vec3(i + 0.5, k + 0.5, l + 0.5) * h - Vec3(edge / 2);
        if (!inside(p, size_a) &&
            !inside(glm::conjugate(pose_b.orientation) * (p - pose_b.position), size_b))
          continue;
        volume += h * h * h;
        first += h * h * h * p;
      }
  EXPECT_NEAR(m.volume / volume, 1, 2e-3);
  EXPECT_NEAR(glm::distance(m.first + m.volume * m.about, first), 0, 2e-3 * volume * 0.05);
}

/// The parallel axis theorem, with two cubes that form a box.
TEST(MassProperties, MassIsSpreadOverAllParts) {
  const Mesh cube = box_mesh(Vec3(0.1));
  const std::vector<stimuli::PlacedMesh> parts = {{cube.get(), {{0.35, 0, 0}, {1, 0, 0, 0}}},
                                                  {cube.get(), {{0.05, 0, 0}, {1, 0, 0, 0}}}};
  const stimuli::MassProperties p = stimuli::with_mass(stimuli::moments_of_union(parts), 3);
  EXPECT_NEAR(p.mass, 3, 1e-14);
  EXPECT_NEAR(p.centre.x, 0.2, 1e-15);
  EXPECT_NEAR(p.inertia[0][0], 3 * 0.01 / 6, 1e-14);
  EXPECT_NEAR(p.inertia[1][1], 3 * 0.01 / 6 + 3 * 0.15 * 0.15, 1e-14);
}

stimuli::Surface surface_of(const std::vector<std::pair<stimuli::PolygonSoup, Pose>>& soups) {
  std::vector<stimuli::SurfaceShell> shells;
  for (const auto& [soup, pose] : soups)
    shells.push_back(
        {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
         pose,
         {}});
  return stimuli::Surface(shells);
}

/// A closed surface has the properties of the convex parts that it bounds; overlapping shells count
/// once.
TEST(MassProperties, ClosedSurfaceMatchesTheUnionOfItsParts) {
  const Vec3 size_a(0.1, 0.04, 0.06), size_b(0.05, 0.09, 0.03);
  const Pose far{{3, -2, 1}, glm::normalize(Quat(1, 0.3, -0.2, 0.4))};
  const Pose beside{{0.5, 0, 0}, {1, 0, 0, 0}}, over{{0.02, 0.015, 0.01}, far.orientation};
  const Mesh a = box_mesh(size_a), b = box_mesh(size_b);
  for (const Pose& pose_b : {beside, over}) {
    const std::vector<stimuli::PlacedMesh> parts = {{a.get(), stimuli::compose(far, {})},
                                                    {b.get(), stimuli::compose(far, pose_b)}};
    const stimuli::MassProperties expected =
        stimuli::with_density(stimuli::moments_of_union(parts), 1000);
    const stimuli::MassProperties found = stimuli::with_density(
        stimuli::moments_of_surface(
            surface_of({{stimuli::box(size_a), {}}, {stimuli::box(size_b), pose_b}}), far),
        1000);
    const double slack = pose_b.position == beside.position ? 1e-11 : 3e-4;
    EXPECT_NEAR(found.mass / expected.mass, 1, slack);
    EXPECT_LT(glm::distance(found.centre, expected.centre), slack * 0.1);
    expect_matrix(found.inertia, expected.inertia, slack * expected.inertia[0][0]);
  }
}

/// Convex parts of a mesh with rounded coordinates abut with steps and gaps.
TEST(MassProperties, RoundedFilesPartsMatchItsSurface) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (int round = 0; round < 160; ++round) {
    const bool ring = round % 2 == 0;
    const int steps = 3 + round % 14;
    stimuli::PolygonSoup soup =
        ring ? stimuli::solids::torus(0.03, 0.01, 12, 8).soup : stimuli::solids::stair(steps).soup;
    if (ring) stimuli::solids::split_polygons(soup);
    const Quat turn = stimuli::uniform_rotation(random);
    const double grain = std::array{0x1p-30, 1e-8, 1e-6}[random.below(3)];  // m
    const auto round_off = [&](stimuli::PolygonSoup& some) {
      for (Vec3& v : some.vertices) v = glm::round((turn * v) / grain) * grain;
      some.coordinate_error = 0.5 * grain;
    };
    round_off(soup);
    std::vector<stimuli::ConvexMesh> parts;
    for (stimuli::PolygonSoup part :
         ring ? stimuli::solids::torus_sections(0.03, 0.01, 12, 8)
              : stimuli::solids::slabs(stimuli::solids::stair_outline(steps), 0.05)) {
      round_off(part);
      parts.emplace_back(part);
    }
    std::vector<stimuli::PlacedMesh> placed;
    for (const stimuli::ConvexMesh& part : parts) placed.push_back({&part, {}});
    const stimuli::MassProperties expected =
        stimuli::with_density(stimuli::moments_of_surface(surface_of({{soup, {}}}), {}), 1000);
    const stimuli::MassProperties found =
        stimuli::with_density(stimuli::moments_of_union(placed), 1000);
    const double slack = 1e3 * grain;  // of the size: some hundred times that of the grain
    EXPECT_NEAR(found.mass / expected.mass, 1, slack) << round;
    EXPECT_LT(glm::distance(found.centre, expected.centre), 0.1 * slack) << round;
    expect_matrix(found.inertia, expected.inertia, slack * expected.inertia[0][0]);
  }
}

}  // namespace
}  // namespace palpate::rendering::test
