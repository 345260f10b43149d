// Reading of .msh files, good and bad.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "stimuli/solids/solid_mesh.h"

namespace palpate::stimuli {
namespace {

/// Two tetrahedra on both sides of a triangle; the second is inside out. Node 9 belongs to no
/// element.
std::string two_tetrahedra() {
  return "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
         "$PhysicalNames\n1\n3 1 \"organ\"\n$EndPhysicalNames\n"
         "$Nodes\n2 6 1 9\n2 1 0 3\n1\n2\n4\n0 0 0\n0.02 0 0\n0 0.02 0\n"
         "3 1 0 3\n7\n5\n9\n0 0 0.02\n0 0 -0.02\n1 1 1\n$EndNodes\n"
         "$Elements\n2 3 1 3\n2 1 2 1\n1 1 2 4\n3 1 4 2\n2 1 2 4 7\n3 1 2 4 5\n$EndElements\n";
}

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

void expect_fault(const std::string& text, const std::string& place, const std::string& expected) {
  try {
    read_gmsh("organ.msh", text);
    ADD_FAILURE() << "no fault: " << expected;
  } catch (const MeshError& error) {
    EXPECT_NE(std::string(error.what()).find("organ.msh: " + place), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
  }
}

TEST(GmshFile, TetrahedraGetMiddlesAndAreTurnedOutward) {
  const SolidMesh mesh = read_gmsh("organ.msh", two_tetrahedra());
  ASSERT_EQ(mesh.tetrahedra.size(), 2U);
  EXPECT_EQ(mesh.nodes.size(), 5U + 9U);  // five corners, nine edges
  constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (const QuadraticTetrahedron& t : mesh.tetrahedra) {
    const auto at = [&](int k) { return mesh.nodes[t[static_cast<std::size_t>(k)]]; };
    EXPECT_NEAR(glm::dot(glm::cross(at(1) - at(0), at(2) - at(0)), at(3) - at(0)), 8e-6, 1e-18);
    for (int e = 0; e < 6; ++e)
      EXPECT_LT(glm::distance(at(4 + e), 0.5 * (at(kEdges[e][0]) + at(kEdges[e][1]))), 1e-15);
  }
  EXPECT_EQ(surface_of(mesh).size(), 6U * 4U);
}

TEST(GmshFile, AnObjectScalesItsNodes) {
  ObjectSpec organ;
  organ.shape = ShapeKind::mesh;
  organ.file = "organ.msh";
  organ.file_bytes = std::make_shared<const std::string>(two_tetrahedra());
  organ.scale = 0.001;
  const std::vector<Vec3> nodes = read_gmsh("organ.msh", two_tetrahedra()).nodes;
  const std::vector<Vec3> scaled = solid_of_file(organ).nodes;
  ASSERT_EQ(scaled.size(), nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) EXPECT_EQ(scaled[i], 0.001 * nodes[i]);
}

TEST(GmshFile, QuadraticTetrahedraKeepTheirMiddles) {
  // Gmsh's order of edges: 01, 12, 02, 03, 23, 13.
  const std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 10 1 10\n3 1 0 10\n"
      "1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n0 0 0\n2 0 0\n0 2 0\n0 0 2\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n"
      "0 1 1\n1 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 11 1\n1 1 2 3 4 5 6 7 8 9 "
      "10\n$EndElements\n";
  const SolidMesh mesh = read_gmsh("organ.msh", text);
  ASSERT_EQ(mesh.tetrahedra.size(), 1U);
  EXPECT_EQ(mesh.nodes[mesh.tetrahedra[0][8]], Vec3(1, 0, 1));
  EXPECT_EQ(mesh.nodes[mesh.tetrahedra[0][9]], Vec3(0, 1, 1));
}

TEST(GmshFile, EveryFaultIsNamedWithItsLine) {
  const std::string good = two_tetrahedra();
  expect_fault(with(good, "4.1 0 8", "2.2 0 8"), "line 2", "version 4.1");
  expect_fault(with(good, "4.1 0 8", "4.1 1 8"), "line 2", "ASCII");
  expect_fault(with(good, "0.02 0 0\n", "0.02 zero 0\n"), "line 15", "three coordinates");
  expect_fault(with(good, "0.02 0 0\n", "0.02 inf 0\n"), "line 15", "three coordinates");
  expect_fault(with(good, "2 1 2 4 7", "2 1 2 4 8"), "line 30", "a node of $Nodes");
  expect_fault(with(good, "2 1 2 4 7", "2 1 2 4"), "line 30", "a tag and four nodes");
  expect_fault(with(good, "3 1 4 2\n", "3 1 5 2\n"), "line 29", "tetrahedra");
  expect_fault(with(good, "0 0 0.02\n", "0.01 0.01 0\n"), "line 30", "a tetrahedron with a volume");
  expect_fault(good.substr(0, good.find("$Elements")), "end", "$Elements");
  expect_fault("", "end", "$MeshFormat");
  expect_fault("solid cube\n", "line 1", "a section");
  expect_fault(with(good, "2 6 1 9", "2 99999999999 1 9"), "line 9", "at most");
}

TEST(GmshFile, ElementsFillSpaceOnce) {
  const std::string two = "3 1 4 2\n2 1 2 4 7\n3 1 2 4 5\n";
  expect_fault(with(two_tetrahedra(), two, "3 1 4 3\n2 1 2 4 7\n3 1 2 4 5\n4 5 1 2 4\n"), "line 32",
               "each tetrahedron once");
  expect_fault(with(two_tetrahedra(), two, "3 1 4 3\n2 1 2 4 7\n3 1 2 4 5\n4 1 2 4 9\n"), "line 32",
               "at most two tetrahedra on a face");
  expect_fault(with(two_tetrahedra(), "2 6 1 9", "2 5 1 9"), "line 23", "5 nodes");
}

TEST(GmshFile, ATruncatedFileGivesFaultsOnly) {
  const std::string good = two_tetrahedra();
  for (std::size_t length = 0; length + 2 < good.size(); ++length)
    EXPECT_THROW(read_gmsh("cut.msh", good.substr(0, length)), MeshError) << length;
}

}  // namespace
}  // namespace palpate::stimuli
