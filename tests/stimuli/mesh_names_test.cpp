// Names of a mesh's vertices and faces in messages: whole texts.

#include "stimuli/mesh_names.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace palpate::stimuli {
namespace {
namespace naming {

const Vec3 kPlace(0.01, -2, 1.0 / 3);

MeshNaming named(MeshNames names) {
  return MeshNaming(std::make_shared<const MeshNames>(std::move(names)));
}

TEST(MeshNaming, WithoutNamesNumbersCountFromZero) {
  const MeshNaming plain;
  EXPECT_EQ(plain.label(5, kPlace), "5");
  EXPECT_EQ(plain.vertex(5, kPlace), "vertex 5");
  EXPECT_EQ(plain.face(3, {"1", "2", "5"}), "face 3 (vertices 1 2 5)");
}

TEST(MeshNaming, NamesVerticesAndFacesByLines) {
  const MeshNaming lines = named({{{7, 12}, {8, 13}}, {{3, 20}}, "line", {}});
  EXPECT_EQ(lines.label(1, kPlace), "8");
  EXPECT_EQ(lines.vertex(0, kPlace), "vertex 7 at line 12");
  EXPECT_EQ(lines.vertex(1, kPlace), "vertex 8 at line 13");
  EXPECT_EQ(lines.face(0, {"7", "8"}), "face 3 at line 20 (vertices 7 8)");
  // Beyond the file's numbers: by place, and by corners alone.
  EXPECT_EQ(lines.label(2, kPlace), "(0.01, -2, 0.333333)");
  EXPECT_EQ(lines.vertex(2, kPlace), "vertex (0.01, -2, 0.333333)");
  EXPECT_EQ(lines.face(1, {"7"}), "face (vertices 7)");
}

TEST(MeshNaming, NamesByPlacesOrByNumbersAlone) {
  const MeshNaming places = named({{{4, 1}}, {{6, 0}}, "", {"/meshes/0", "/meshes/1"}});
  EXPECT_EQ(places.vertex(0, kPlace), "vertex 4 of /meshes/1");
  EXPECT_EQ(places.face(0, {"4"}), "face 6 of /meshes/0 (vertices 4)");
  const MeshNaming numbers = named({{{4, 1}}, {{6, 0}}, "", {}});
  EXPECT_EQ(numbers.vertex(0, kPlace), "vertex 4");
  EXPECT_EQ(numbers.face(0, {"4"}), "face 6 (vertices 4)");
}

TEST(MeshNaming, ManyCornersAreCutShortAfterEight) {
  const std::vector<std::string> eight{"1", "2", "3", "4", "5", "6", "7", "8"};
  EXPECT_EQ(MeshNaming().face(0, eight), "face 0 (vertices 1 2 3 4 5 6 7 8)");
  std::vector<std::string> nine = eight;
  nine.push_back("9");
  EXPECT_EQ(MeshNaming().face(0, nine), "face 0 (vertices 1 2 3 4 5 6 7 8 ...)");
}

TEST(MeshNames, SubsetKeepsTheChosenNamesInOrder) {
  const MeshNames all{{{1, 10}, {2, 11}, {3, 12}}, {{7, 20}, {8, 21}}, "byte", {"a"}};
  const MeshNames some = all.subset({2, 0}, {1});
  ASSERT_EQ(some.vertices.size(), 2U);
  EXPECT_EQ(some.vertices[0].number, 3U);
  EXPECT_EQ(some.vertices[0].place, 12U);
  EXPECT_EQ(some.vertices[1].number, 1U);
  ASSERT_EQ(some.faces.size(), 1U);
  EXPECT_EQ(some.faces[0].number, 8U);
  EXPECT_EQ(some.place_kind, "byte");
  EXPECT_EQ(some.places, std::vector<std::string>{"a"});
  // A mesh without names gets none.
  const MeshNames none = MeshNames{{}, {}, "byte", {}}.subset({0, 1}, {0});
  EXPECT_TRUE(none.vertices.empty());
  EXPECT_TRUE(none.faces.empty());
}

}  // namespace naming
}  // namespace
}  // namespace palpate::stimuli
