// Rendering of layered objects, built like scene files: the inside of an object, and layers that
// break.

#include "runner/scene_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iomanip>
#include <string>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/render_fault.h"
#include "rendering/renderer.h"
#include "rendering/union_contact.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner {
namespace {

constexpr double kServoPeriod = 1e-3;  // s
constexpr double kHalf = 0.025;        // m, of a cube

stimuli::Material of(double surface, std::vector<stimuli::Layer> layers) {
  stimuli::Material material;
  material.stiffness = surface;
  material.layers = std::move(layers);
  return material;
}

stimuli::ObjectSpec box(const Vec3& low, const Vec3& high, const stimuli::Material& material) {
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::box;
  spec.size = high - low;
  spec.pose.position = 0.5 * (low + high);
  spec.material = material;
  return spec;
}

stimuli::ObjectSpec cube(const stimuli::Material& material) {
  return box(Vec3(-kHalf), Vec3(kHalf), material);
}

stimuli::ObjectSpec compound(std::vector<stimuli::ObjectSpec> parts) {
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::compound;
  spec.parts = std::move(parts);
  return spec;
}

/// An upright stylus in a scene, moved to a depth below the cube's upper face.
class Press {
 public:
  explicit Press(const stimuli::ObjectSpec& object, const rendering::Tool& tool = {})
      : scene_(SceneBuilder().build({object}, true, tool)), state_(scene_.initial_state()) {}

  rendering::Rendering at(double depth, double x = 0.004) {
    const Vec3 tip(x, 0.003, kHalf - depth);
    return rendering::ray_renderer().tick(scene_, state_, {tip, tip + Vec3(0, 0, 0.12)},
                                          kServoPeriod);
  }
  double force(double depth, double x = 0.004) { return at(depth, x).force.z; }
  /// Largest force on a slow path between depths, N.
  double largest_force(double from, double to, double x = 0.004) {
    double most = 0;
    const int ticks = static_cast<int>(std::abs(to - from) / 2e-5);
    for (int i = 0; i <= ticks; ++i)
      most = std::max(most, force(from + (to - from) * i / ticks, x));
    return most;
  }

 private:
  rendering::Scene scene_;
  rendering::RenderState state_;
};

class LayerThatBreaks : public ::testing::TestWithParam<double> {};

TEST_P(LayerThatBreaks, BreaksWhateverElseTheObjectHas) {
  const double surface = GetParam(), step = 500 * 2e-5;
  const stimuli::Material material = of(surface, {{0.02, 500, 0, 1.0}});
  for (const rendering::Tool& tool :
       {rendering::Tool{}, rendering::Tool{{{{0, 0, 0}, {0, 0, 0.12}}}}}) {
    Press press(cube(material), tool);
    const double most = press.largest_force(-0.005, 0.024);
    EXPECT_GE(most, 1 + surface * 0.021 - 2 * step);
    EXPECT_LE(most, 1 + surface * 0.023 + 2 * step);
    for (int i = 0; i < 25; ++i) press.at(0.024);
    EXPECT_NEAR(press.force(0.024), surface * 0.024, 1e-9);
    // Out of the layer, not out of the object: it stays broken.
    press.largest_force(0.024, 0.010);
    EXPECT_NEAR(press.largest_force(0.010, 0.024), surface * 0.024, 1e-9);
    // Out of the object: whole again.
    press.largest_force(0.024, -0.002);
    EXPECT_GT(press.largest_force(-0.002, 0.0215), 0.74);
  }
}

INSTANTIATE_TEST_SUITE_P(UnderSurfaces, LayerThatBreaks, ::testing::Values(0.0, 0.001, 50.0));

TEST(SceneBuilder, BareLayersAreInsideFromTheStart) {
  for (const double surface : {0.0, 0.001}) {
    Press press(cube(of(surface, {{0.012, 500, 0, {}}})));
    for (const double depth : {0.010, 0.015, 0.022, 0.003}) {
      const rendering::Rendering r = press.at(depth);
      EXPECT_EQ(r.force, Vec3(0)) << depth;
      EXPECT_EQ(r.faults, rendering::render_fault::kStartedInside) << depth;
    }
    press.at(-0.001);
    const rendering::Rendering r = press.at(0.015);
    EXPECT_NEAR(r.force.z, surface * 0.015 + 500 * 0.003, 1e-9);
    EXPECT_EQ(r.faults, 0u);
  }
}

TEST(SceneBuilder, ASurfaceWithoutStiffnessHasNoForceAndNoContact) {
  Press press(cube(of(0, {{0.012, 500, 0, {}}})));
  press.at(-0.001);
  const rendering::Rendering over = press.at(0.011), in = press.at(0.013);
  EXPECT_EQ(over.contacts, 0);
  EXPECT_EQ(over.force, Vec3(0));
  EXPECT_EQ(over.faults, 0u);
  EXPECT_EQ(in.contacts, 1);
  EXPECT_NEAR(in.deepest.depth, 0.001, 1e-9);
}

TEST(SceneBuilder, AStylusInsideAnotherPartHasNotLeftTheCompound) {
  // A block without stiffness stands on the layered one.
  Press press(compound({cube(of(0, {{0.005, 500, 0, 1.0}})),
                        box({-kHalf, -kHalf, kHalf}, {kHalf, kHalf, 3 * kHalf}, of(0, {}))}));
  press.at(-3 * kHalf);
  EXPECT_NEAR(press.largest_force(-3 * kHalf, 0.012), 1, 0.02);
  for (int i = 0; i < 25; ++i) press.at(0.012);
  press.largest_force(0.012, -0.01);
  EXPECT_EQ(press.largest_force(-0.01, 0.012), 0) << "still inside of the block above";
  press.largest_force(0.012, -2 * kHalf - 0.001);
  EXPECT_GT(press.largest_force(-2 * kHalf - 0.001, 0.0065), 0.7);
}

TEST(SceneBuilder, EachPartOfACompoundHasItsOwnBreakingForce) {
  // Breaking at 1 N on the left, 3 N on the right, never in the middle; in any order.
  const auto part = [](double x, std::optional<double> breaks) {
    return box({x - 0.02, -kHalf, -kHalf}, {x + 0.02, kHalf, kHalf},
               of(0, {{0.002, 1000, 0, breaks}}));
  };
  std::vector<stimuli::ObjectSpec> parts{part(-0.05, 1), part(0, {}), part(0.05, 3)};
  std::sort(parts.begin(), parts.end(),
            [](const auto& a, const auto& b) { return a.pose.position.x < b.pose.position.x; });
  do {
    const double step = 1000 * 2e-5;
    for (const double x : {-0.05, 0.0, 0.05}) {
      const double bound = x < 0 ? 1 : x > 0 ? 3 : 6;
      Press press(compound(parts));
      press.at(-0.001, x);
      EXPECT_NEAR(press.largest_force(-0.001, 0.008, x), bound, 2 * step) << x;
    }
  } while (std::next_permutation(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return a.pose.position.x < b.pose.position.x;
  }));
}

TEST(SceneBuilder, ABrokenPartLeavesItsNeighboursWhole) {
  const auto part = [](double low, double high, std::optional<double> breaks) {
    return box({low, -kHalf, -kHalf}, {high, kHalf, kHalf}, of(100, {{0.002, 1000, 0, breaks}}));
  };
  Press press(compound({part(-kHalf, 0, 1.0), part(0, kHalf, {})}));
  press.largest_force(-0.001, 0.006, -0.012);
  for (int i = 0; i < 25; ++i) press.at(0.006, -0.012);
  EXPECT_NEAR(press.force(0.006, -0.012), 100 * 0.006, 1e-9);
  for (double x = -0.012; x < 0.012; x += 1e-4) press.at(0.001, x);
  EXPECT_NEAR(press.largest_force(0.001, 0.006, 0.012), 100 * 0.006 + 1000 * 0.004, 1e-9);
}

TEST(SceneBuilder, ALayerContinuesFromPartToPart) {
  const stimuli::Material material = of(0, {{0.003, 1000, 0, {}}});
  const stimuli::ObjectSpec left = box(Vec3(-kHalf), {0, kHalf, kHalf}, material),
                            right = box({0, -kHalf, -kHalf}, Vec3(kHalf), material);
  for (const auto& object : {compound({left, right}), compound({right, compound({left})})}) {
    Press press(object);
    for (double depth = -0.001; depth < 0.005; depth += 1e-4) press.at(depth, -0.01);
    for (double x = -0.01; x < 0.01; x += 1e-4) {
      const rendering::Rendering r = press.at(0.005, x);
      ASSERT_LE(glm::length(r.force - Vec3(0, 0, 1000 * 0.002)), 1e-6) << x;
    }
    // Deeper than the half of either part.
    EXPECT_NO_THROW(SceneBuilder().build(
        {compound({box(Vec3(-kHalf), {0, kHalf, kHalf}, of(0, {{0.02, 1000, 0, {}}})),
                   box({0, -kHalf, -kHalf}, Vec3(kHalf), of(0, {{0.02, 1000, 0, {}}}))})},
        true));
  }
}

TEST(SceneBuilder, ALayerOfSomePartsLiesBelowTheWholeObjectsSurface) {
  // The lower block has the layer; a slab on it has none, or a different one.
  const auto lower = box(Vec3(-kHalf), {kHalf, kHalf, 0.02}, of(0, {{0.002, 1000, 0, {}}}));
  const auto upper = [](std::vector<stimuli::Layer> layers) {
    return box({-kHalf, -kHalf, 0.02}, {kHalf, kHalf, kHalf}, of(100, std::move(layers)));
  };
  const double slab = kHalf - 0.02;
  for (const bool turned_round : {false, true}) {
    const auto scene_of = [&](std::vector<stimuli::Layer> layers) {
      return turned_round ? compound({lower, upper(std::move(layers))})
                          : compound({upper(std::move(layers)), lower});
    };
    // There is no surface between slab and block: the layer begins directly below the slab.
    Press press(scene_of({}));
    press.at(-0.001);
    for (const double depth : {0.001, 0.0049, 0.0051, 0.007, 0.012}) {
      EXPECT_NEAR(press.force(depth), 100 * depth + 1000 * std::max(0.0, depth - slab), 1e-6)
          << depth;
    }
    // Down to the seam that of the slab, 1 mm under its top, beyond it both: one ideal tool.
    Press both(scene_of({{0.001, 400, 0, {}}}));
    both.at(-0.001);
    for (const double depth : {0.0005, 0.002, 0.0049, 0.007})
      EXPECT_NEAR(both.force(depth), 100 * depth + 400 * std::max(0.0, depth - 0.001), 1e-6);
  }
}

TEST(SceneBuilder, LayersThatDifferFromPartToPartMeetAtTheSeam) {
  // Equal except for the breaking force, or deeper on the right.
  for (const double deeper : {0.0, 0.002}) {
    const auto left = box(Vec3(-kHalf), {0, kHalf, kHalf}, of(0, {{0.003, 1000, 0, {}}}));
    const auto right = box({0, -kHalf, -kHalf}, Vec3(kHalf),
                           of(0, {{0.003 + deeper, 1000, 0, deeper > 0 ? 90.0 : 100.0}}));
    Press press(compound({left, right}));
    for (double depth = -0.001; depth < 0.006; depth += 1e-4) press.at(depth, -0.01);
    for (double x = -0.01; x < 0.01; x += 1e-4) {
      const rendering::Rendering r = press.at(0.006, x);
      if (std::abs(x) < 5e-5) continue;
      const double top = x > 0 ? 0.003 + deeper : 0.003;
      ASSERT_LE(glm::length(r.force - Vec3(0, 0, 1000 * (0.006 - top))), 1e-3)
          << deeper << " at " << x;
    }
  }
}

TEST(SceneBuilder, StatesTheGreatestDepthOfACompoundsLayers) {
  const stimuli::Material material = of(0, {{0.026, 1000, 0, {}}});
  try {
    SceneBuilder().build({compound({box(Vec3(-kHalf), {0, kHalf, kHalf}, material),
                                    box({0, -kHalf, -kHalf}, Vec3(kHalf), material)})},
                         true);
    FAIL() << "nothing is left";
  } catch (const stimuli::MeshError& error) {
    ASSERT_EQ(error.faults().size(), 1u);
    EXPECT_EQ(error.faults()[0],
              "/objects/0/layers/0/depth_m: nothing of the object is left at a depth of 0.026 m; "
              "expected less than 0.025 m");
  }
}

/// An L of two bars, as a file. \param bar  m, how thick they are
stimuli::ObjectSpec angle(const std::string& file, const stimuli::Material& material,
                          double bar = 0.02) {
  std::ofstream out(file);
  for (const double z : {0.0, 0.03}) {
    out << "v 0 0 " << z << "\nv .06 0 " << z << "\nv .06 " << bar << ' ' << z << "\nv " << bar
        << ' ' << bar << ' ' << z << "\nv " << bar << " .06 " << z << "\nv 0 .06 " << z << '\n';
  }
  out << "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\n"
         "f 5 6 12 11\nf 6 1 7 12\n";
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::mesh;
  spec.file = file;
  spec.material = material;
  return spec;
}

TEST(SceneBuilder, BodyMassCountsAllParts) {
  const palpate::testing::TemporaryFolder folder;
  const stimuli::Material felt = of(800, {}), layer = of(0, {{0.002, 500, 0, {}}}),
                          both = of(300, {{0.002, 500, 0, {}}});
  const auto floor = box({-0.2, -0.2, -0.32}, {0.2, 0.2, -0.3}, felt);
  const double of_angle = 6e-5, of_box = 8e-6, density = 1000;  // m^3, kg/m^3
  const Vec3 middle =
      (of_angle * Vec3(0.022, 0.022, 0.015) + of_box * Vec3(0.2, 0, 0)) / (of_angle + of_box);
  for (const auto& of_mesh : {felt, layer, both}) {
    for (const auto& of_other : {felt, layer, both}) {
      stimuli::ObjectSpec body =
          compound({angle(folder / "angle.obj", of_mesh),
                    box({0.19, -0.01, -0.01}, {0.21, 0.01, 0.01}, of_other)});
      body.body = stimuli::Body{.density = density};
      for (const std::size_t objects : {1, 2}) {
        std::vector<stimuli::ObjectSpec> scene{body, floor};
        scene.resize(objects);
        const rendering::Scene built = SceneBuilder().build(scene, true);
        const auto summary = rendering::moving_summary(built);
        EXPECT_NEAR(summary->heaviest, density * (of_angle + of_box), 1e-9);
        EXPECT_EQ(summary->part_pairs, objects == 1 ? 0U : 1U) << "it meets by its surface";
        const rendering::RenderState state = built.initial_state();
        EXPECT_LT(glm::distance(state.motion.bodies()[0].centre, middle), 1e-9);
      }
    }
  }
}

/// A ball with a rough surface, as a file.
stimuli::ObjectSpec lump_of(const std::string& file, const stimuli::Material& material) {
  stimuli::PolygonSoup soup = stimuli::icosphere(0.02, 3);
  Random random(7);
  {
    std::ofstream out(file);
    out << std::setprecision(17);
    for (const Vec3& v : soup.vertices) {
      const double scale = 0.7 + 0.5 * random.unit();
      out << "v " << scale * v.x << ' ' << scale * v.y << ' ' << scale * v.z << '\n';
    }
    for (const auto& face : soup.faces)
      out << "f " << face[0] + 1 << ' ' << face[1] + 1 << ' ' << face[2] + 1 << '\n';
  }
  stimuli::ObjectSpec lump;
  lump.shape = stimuli::ShapeKind::mesh;
  lump.file = file;
  lump.material = material;
  return lump;
}

TEST(SceneBuilder, ThinLayerNamesADepthThatWorks) {
  const palpate::testing::TemporaryFolder folder;
  stimuli::ObjectSpec lump =
      lump_of(folder / "lump.obj", of(800, {{1e-6, 500, 0, {}}, {2e-6, 500, 0, {}}}));
  std::vector<std::string> faults;
  try {
    SceneBuilder().build({lump}, true);
  } catch (const stimuli::MeshError& error) {
    faults = error.faults();
  }
  ASSERT_EQ(faults.size(), 2u);
  EXPECT_NE(faults[1].find("/layers/1/depth_m: where the surface is concave"), std::string::npos)
      << faults[1];
  const std::string& fault = faults[0];
  EXPECT_NE(fault.find("/layers/0/depth_m: where the surface is concave"), std::string::npos)
      << fault;
  const std::string expected = "; expected at least ";
  const std::size_t at = fault.find(expected);
  ASSERT_NE(at, std::string::npos) << fault;
  lump.material.layers.resize(1);
  lump.material.layers[0].depth = std::stod(fault.substr(at + expected.size()));
  EXPECT_NO_THROW(SceneBuilder().build({lump}, true)) << fault;
}

TEST(SceneBuilder, ThinLayerOfASheetNamesNoDepth) {
  const palpate::testing::TemporaryFolder folder;
  const stimuli::ObjectSpec sheet =
      angle(folder / "sheet.obj", of(800, {{1e-6, 500, 0, {}}}), 0.0003);
  std::string fault;
  try {
    SceneBuilder().build({sheet}, true);
  } catch (const stimuli::MeshError& error) {
    fault = error.faults().front();
  }
  EXPECT_NE(fault.find("; expected a deeper layer or a thicker object"), std::string::npos)
      << fault;
}

TEST(SceneBuilder, LumpWithoutConvexPartsFallsOnWhatStands) {
  const palpate::testing::TemporaryFolder folder;
  stimuli::ObjectSpec lump = lump_of(folder / "lump.obj", of(800, {}));
  stimuli::ObjectSpec other = lump;
  lump.pose.position = {0.002, 0, 0.06};
  lump.body = stimuli::Body{.mass = 0.05};
  const rendering::Scene scene = SceneBuilder().build(
      {lump, other, box({-4, -4, -0.06}, {4, 4, -0.04}, of(800, {}))}, true, {}, {0, 0, -9.81});
  rendering::RenderState state = scene.initial_state();
  const rendering::LineProbe far{{5, 5, 5}, {5, 5, 5.12}};
  double lowest = 1;
  for (int i = 0; i < 1500; ++i) {
    rendering::ray_renderer().tick(scene, state, far, kServoPeriod);
    lowest = std::min(lowest, state.motion.bodies()[0].centre.z);
  }
  EXPECT_GT(lowest, -0.04 + 0.008) << "through the floor";
  EXPECT_LT(state.motion.bodies()[0].centre.z, 0.045) << "it has not fallen";
}

/// Two blocks that abut, each a group of a file. \param step  m, from one upper face to the other
stimuli::ObjectSpec two_blocks(const std::string& file, double step) {
  std::ofstream out(file);
  out << std::fixed << std::setprecision(7);
  for (const double x : {0.0, 0.05}) {
    out << "g block" << x << '\n';
    const double top = x > 0 ? 0.0123457 + step : 0.0123457;
    for (const double z : {-0.0213579, top}) {
      for (const auto& [dx, y] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
        out << "v " << x + 0.05 * dx << ' ' << 0.04 * y << ' ' << z << '\n';
    }
    const char* const base = x > 0 ? "f 12 11 10 9\nf 13 14 15 16\nf 9 10 14 13\nf 10 11 15 14\n"
                                     "f 11 12 16 15\nf 12 9 13 16\n"
                                   : "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n"
                                     "f 4 1 5 8\n";
    out << base;
  }
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::mesh;
  spec.file = file;
  spec.material = of(800, {});
  return spec;
}

TEST(SceneBuilder, GroupsWithAStepOfRoundingBetweenThemAreOneSurface) {
  const palpate::testing::TemporaryFolder folder;
  const stimuli::ObjectSpec exact = two_blocks(folder / "exact.obj", 0),
                            stepped = two_blocks(folder / "stepped.obj", 1e-7),
                            meant = two_blocks(folder / "meant.obj", 1e-3);
  SceneBuilder builder;
  EXPECT_EQ(builder.mesh(exact).parts.size(), 2U);
  EXPECT_EQ(builder.mesh(meant).parts.size(), 2U);
  EXPECT_TRUE(builder.mesh(stepped).parts.empty());
  for (const auto& object : {stepped, compound({stepped})}) {
    const rendering::Scene scene = builder.build({object}, true);
    ASSERT_EQ(scene.surfaces().size(), 1U);
    EXPECT_NEAR(scene.surfaces()[0].surface->seam(), 1e-7, 1e-12);
  }
}

TEST(SceneBuilder, FilesThatAbutWithAStepOfRoundingAreOneSurface) {
  const palpate::testing::TemporaryFolder folder;
  const auto block = [&](const char* name, double low, double high, double top) {
    std::ofstream out(folder / name);
    out << std::fixed << std::setprecision(7);
    for (const double z : {-0.0213579, top}) {
      for (const auto& [x, y] : {std::pair{low, 0.0}, {high, 0.0}, {high, 0.04}, {low, 0.04}})
        out << "v " << x << ' ' << y << ' ' << z << '\n';
    }
    out << "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    stimuli::ObjectSpec spec;
    spec.shape = stimuli::ShapeKind::mesh;
    spec.file = folder / name;
    spec.material = of(800, {});
    return spec;
  };
  const auto left = block("left.obj", 0, 0.05, 0.0123457);
  const auto level = block("level.obj", 0.05, 0.08, 0.0123457);
  const auto higher = block("higher.obj", 0.05, 0.08, 0.0123458);
  EXPECT_EQ(SceneBuilder().build({compound({left, level})}, true).parts().size(), 2U);
  EXPECT_EQ(SceneBuilder().build({compound({left, higher})}, true).surfaces().size(), 1U);
  EXPECT_EQ(SceneBuilder().build({left, higher}, true).surfaces().size(), 1U) << "two objects";
  stimuli::ObjectSpec apart = higher;
  apart.pose.position.x = 0.01;
  EXPECT_EQ(SceneBuilder().build({left, apart}, true).surfaces().size(), 0U);
}

TEST(SceneBuilder, ReadsAMeshFileOnceForAllItsScenes) {
  const palpate::testing::TemporaryFolder folder;
  const std::string concave = folder / "angle.obj", convex = folder / "corner.obj";
  const stimuli::ObjectSpec bracket = angle(concave, of(800, {}));
  std::ofstream(convex) << "v 0 0 0\nv .1 0 0\nv 0 .2 0\nv 0 0 .3\n"
                           "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  stimuli::ObjectSpec corner = bracket;
  corner.file = convex;
  SceneBuilder builder;
  EXPECT_EQ(builder.mesh(bracket).faces, 8U);
  EXPECT_LT(glm::distance(builder.mesh(corner).size, Vec3(0.1, 0.2, 0.3)), 1e-12);
  ASSERT_TRUE(std::filesystem::remove(concave) && std::filesystem::remove(convex));
  for (const bool sides : {false, true}) {
    const rendering::Scene scene = builder.build({bracket, corner}, sides);
    EXPECT_EQ(scene.surfaces().size(), 1U);
    EXPECT_EQ(scene.parts().size(), 1U);
  }
}

}  // namespace
}  // namespace palpate::runner
