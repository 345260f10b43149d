// Fixed objects side by side are felt as one solid: a tool slides over their seams as over one file
// of all of them, and each place has the material of its object.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iomanip>
#include <string>
#include <utility>
#include <vector>

#include "runner/scene_builder.h"
#include "stimuli/orientation.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner {
namespace {

constexpr double kStiffness = 800;              // N/m
constexpr Vec3 kTile = Vec3(0.02, 0.03, 0.01);  // m
constexpr double kDepth = 0.002;                // m
constexpr double kLength = 0.12;                // m, of the stylus

stimuli::ObjectSpec box(const Vec3& low, const Vec3& high) {
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::box;
  spec.size = high - low;
  spec.pose.position = 0.5 * (low + high);
  spec.material.stiffness = kStiffness;
  return spec;
}

stimuli::ObjectSpec compound_of(std::vector<stimuli::ObjectSpec> parts) {
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::compound;
  spec.material.stiffness = kStiffness;
  spec.parts = std::move(parts);
  return spec;
}

/// Turns objects about the origin.
std::vector<stimuli::ObjectSpec> turned(std::vector<stimuli::ObjectSpec> objects, const Quat& by) {
  for (stimuli::ObjectSpec& object : objects)
    object.pose = stimuli::compose({Vec3(0), by}, object.pose);
  return objects;
}

enum class Made { boxes, compounds, meshes };

/// Rows of tiles, their upper sides at z = 0; meshes have a lower step along y.
class Tiles {
 public:
  Tiles(Made made, int columns, int rows) : made_(made), columns_(columns), rows_(rows) {}

  std::vector<stimuli::ObjectSpec> apart() const {
    std::vector<stimuli::ObjectSpec> all;
    for (int i = 0; i < columns_ * rows_; ++i)
      all.push_back(tile(i % columns_, i / columns_, 1, 1));
    return all;
  }
  stimuli::ObjectSpec merged() const { return tile(0, 0, columns_, rows_); }

 private:
  stimuli::ObjectSpec tile(int column, int row, int columns, int rows) const {
    const Vec3 low(column * kTile.x, row * kTile.y, -kTile.z);
    const Vec3 high = low + Vec3(columns * kTile.x, rows * kTile.y, kTile.z);
    if (made_ == Made::boxes || (made_ == Made::compounds && columns * rows > 1))
      return box(low, high);
    if (made_ == Made::compounds) {
      const double middle = 0.5 * (low.x + high.x);
      return compound_of({box(low, {middle, high.y, high.z}), box({middle, low.y, low.z}, high)});
    }
    return stepped(low, high);
  }

  /// A prism along x: an L in y and z.
  stimuli::ObjectSpec stepped(const Vec3& low, const Vec3& high) const {
    const std::array<std::array<double, 2>, 6> outline = {{{low.y, low.z},
                                                           {high.y, low.z},
                                                           {high.y, low.z + 0.004},
                                                           {low.y + 0.02, low.z + 0.004},
                                                           {low.y + 0.02, high.z},
                                                           {low.y, high.z}}};
    stimuli::ObjectSpec spec;
    spec.shape = stimuli::ShapeKind::mesh;
    spec.scale = 1;
    spec.material.stiffness = kStiffness;
    spec.file_name = std::to_string(low.x) + '_' + std::to_string(high.x) + ".obj";
    spec.file = folder_ / spec.file_name;
    std::ofstream out(spec.file);
    out << std::setprecision(17);
    for (const double x : {low.x, high.x}) {
      for (const auto& [y, z] : outline) out << "v " << x << ' ' << y << ' ' << z << '\n';
    }
    out << "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
    for (int k = 0; k < 6; ++k) {
      const int next = (k + 1) % 6;
      out << "f " << k + 1 << ' ' << next + 1 << ' ' << next + 7 << ' ' << k + 7 << '\n';
    }
    return spec;
  }

  Made made_;
  int columns_, rows_;
  palpate::testing::TemporaryFolder folder_;
};

/// A slide over the tiles, upright or tilted, pressing from above.
rendering::LineProbe pose_at(int tick, int columns, int rows, const Quat& turn) {
  const double t = tick / 600.0;
  const Vec3 tip(0.003 + t * (columns * kTile.x - 0.006),
                 0.004 + t * t * (rows * kTile.y - (rows > 1 ? 0.008 : 0.02)),
                 std::max(-kDepth, 0.001 - 1e-4 * tick));
  const Vec3 along = glm::normalize(Vec3(0.3 * std::sin(4 * t), 0.2 * std::cos(3 * t), 1));
  return {turn * tip, turn * (tip + kLength * along)};
}

struct Row {
  const char* name;
  Made made;
  int columns, rows;
};

class TouchingObjects : public ::testing::TestWithParam<Row> {};

TEST_P(TouchingObjects, SlideAsOverOneFile) {
  const auto& [name, made, columns, rows] = GetParam();
  const Tiles tiles(made, columns, rows);
  rendering::Tool bent;
  bent.segments = {{Vec3(0), Vec3(0, 0, kLength)}, {Vec3(0), Vec3(0.01, 0, 0.004)}};
  for (const Quat& turn : {Quat(1, 0, 0, 0), glm::normalize(Quat(0.8, 0.3, -0.4, 0.2))}) {
    for (const int tool : {0, 1, 2}) {
      const bool sides = tool > 0;
      const rendering::Renderer& renderer =
          sides ? rendering::ray_renderer() : rendering::point_renderer();
      const rendering::Tool& segments = tool == 2 ? bent : rendering::Tool();
      const rendering::Scene several =
          SceneBuilder().build(turned(tiles.apart(), turn), sides, segments);
      const rendering::Scene one =
          SceneBuilder().build(turned({tiles.merged()}, turn), sides, segments);
      rendering::RenderState a = several.initial_state(), b = one.initial_state();
      for (int tick = 0; tick < 600; ++tick) {
        const rendering::LineProbe probe = pose_at(tick, columns, rows, turn);
        a.measured_side = b.measured_side = turn * Vec3(1, 0, 0);
        const rendering::Rendering x = renderer.tick(several, a, probe, 1e-3),
                                   y = renderer.tick(one, b, probe, 1e-3);
        ASSERT_NEAR(glm::length(x.force - y.force), 0, 1e-9) << tick << " tool " << tool;
        ASSERT_NEAR(glm::length(x.torque - y.torque), 0, 1e-9) << tick << " tool " << tool;
        if (tick > 100) {
          ASSERT_GT(glm::length(y.force), 1) << tick;
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seams, TouchingObjects,
                         ::testing::Values(Row{"TwoBoxes", Made::boxes, 2, 1},
                                           Row{"FiveBoxes", Made::boxes, 5, 1},
                                           Row{"NineBoxes", Made::boxes, 3, 3},
                                           Row{"TwoCompounds", Made::compounds, 2, 1},
                                           Row{"NineCompounds", Made::compounds, 3, 3},
                                           Row{"TwoMeshes", Made::meshes, 2, 1},
                                           Row{"NineMeshes", Made::meshes, 9, 1}),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(TouchingObjectsTest, EachPlaceHasItsObjectsMaterial) {
  std::vector<stimuli::ObjectSpec> tiles = Tiles(Made::boxes, 2, 1).apart();
  tiles[1].material.stiffness = 300;
  const rendering::Scene scene = SceneBuilder().build(tiles, false);
  for (const int tile : {0, 1}) {
    rendering::RenderState state = scene.initial_state();
    rendering::Rendering r;
    for (double z = 0.001; z > -kDepth; z -= 1e-4) {
      const Vec3 tip((tile + 0.5) * kTile.x, 0.01, z);
      r = rendering::point_renderer().tick(scene, state, {tip, tip + Vec3(0, 0, kLength)}, 1e-3);
      EXPECT_NEAR(r.force.z,
                  tiles[static_cast<std::size_t>(tile)].material.stiffness * std::max(0.0, -z),
                  1e-9);
    }
    EXPECT_EQ(r.object, tile);
  }
}

TEST(TouchingObjectsTest, MeshesKeepTheirObjectAndMaterial) {
  const Tiles made(Made::meshes, 2, 1);
  std::vector<stimuli::ObjectSpec> tiles = made.apart();
  tiles[1].material.stiffness = 300;
  const rendering::Scene scene = SceneBuilder().build(tiles, false);
  for (const int tile : {0, 1}) {
    rendering::RenderState state = scene.initial_state();
    rendering::Rendering r;
    for (int i = 0; i < 30; ++i) {
      const Vec3 tip((tile + 0.5) * kTile.x, 0.01, 0.001 - 1e-4 * i);
      r = rendering::point_renderer().tick(scene, state, {tip, tip + Vec3(0, 0, kLength)}, 1e-3);
    }
    EXPECT_NEAR(r.force.z, tiles[static_cast<std::size_t>(tile)].material.stiffness * 0.0019, 1e-9);
    EXPECT_EQ(r.object, tile);
  }
}

using Solids = std::vector<std::vector<int>>;

Solids solids_of(const std::vector<stimuli::ObjectSpec>& objects) {
  return SceneBuilder().solids_of(objects);
}

TEST(TouchingObjectsTest, OnlyFixedOnesThatMeetAreOneSolid) {
  const Vec3 to = kTile;
  const stimuli::ObjectSpec one = box(Vec3(0), to),
                            beside = box({to.x, 0, 0}, {2 * to.x, to.y, to.z}),
                            third = box({2 * to.x, 0, 0}, {3 * to.x, to.y, to.z}),
                            crossing = box(0.5 * to, 1.5 * to), inside = box(0.4 * to, 0.6 * to),
                            at_corner = box(to, 2.0 * to);
  EXPECT_EQ(solids_of({one, beside}), (Solids{{0, 1}}));
  EXPECT_EQ(solids_of({one, third}), (Solids{{0}, {1}}));
  EXPECT_EQ(solids_of({one, third, beside}), (Solids{{0, 1, 2}}));
  EXPECT_EQ(solids_of({one, crossing}), (Solids{{0, 1}}));
  EXPECT_EQ(solids_of({one, at_corner}), (Solids{{0, 1}}));
  EXPECT_EQ(solids_of({one, inside}), (Solids{{0}, {1}}));
  stimuli::ObjectSpec near = beside;
  near.pose.position.x += 1e-5;
  EXPECT_EQ(solids_of({one, near}), (Solids{{0}, {1}}));
  stimuli::ObjectSpec moving = beside;
  moving.body.emplace();
  EXPECT_EQ(solids_of({one, moving}), (Solids{{0}, {1}}));
}

TEST(TouchingObjectsTest, OnesApartKeepAnIdealToolEach) {
  std::vector<stimuli::ObjectSpec> tiles = Tiles(Made::boxes, 2, 1).apart();
  tiles[1].pose.position.x += 1e-3;
  const rendering::Scene scene = SceneBuilder().build(tiles, true);
  EXPECT_EQ(scene.groups().size(), 2U);
  EXPECT_FALSE(scene.features().unions);
}

// Rounded poses leave steps and cracks of rounding, which hold nothing.
TEST(TouchingObjectsTest, RoundedPosesMakeNoWall) {
  for (const double decimals : {1e6, 1e8}) {
    std::vector<stimuli::ObjectSpec> tiles =
        turned(Tiles(Made::boxes, 3, 1).apart(), glm::normalize(Quat(0.7, 0.2, 0.5, -0.3)));
    const Quat turn = tiles[0].pose.orientation;
    for (stimuli::ObjectSpec& tile : tiles)
      tile.pose.position = glm::round(decimals * tile.pose.position) / decimals;
    const rendering::Scene scene = SceneBuilder().build(tiles, true);
    rendering::RenderState state = scene.initial_state();
    for (int tick = 0; tick < 600; ++tick) {
      const Vec3 tip =
          turn * Vec3(0.003 + 0.054 * tick / 600, 0.01, std::max(-kDepth, 1e-3 - 1e-4 * tick));
      const rendering::Rendering r = rendering::ray_renderer().tick(
          scene, state, {tip, tip + turn * Vec3(0, 0, kLength)}, 1e-3);
      if (tick < 100) continue;
      ASSERT_NEAR(glm::dot(r.force, turn * Vec3(0, 0, 1)), kStiffness * kDepth, 2e-3) << tick;
      ASSERT_NEAR(glm::dot(r.force, turn * Vec3(1, 0, 0)), 0, 2e-3) << tick;
    }
  }
}

}  // namespace
}  // namespace palpate::runner
