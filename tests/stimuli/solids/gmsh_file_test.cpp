// Reading of .msh files, good and bad.

#include "stimuli/solids/gmsh_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "stimuli/polygon_soup.h"
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

std::string version_1() {
  return "$NOD\n6\n1 0 0 0\n2 0.02 0 0\n4 0 0.02 0\n7 0 0 0.02\n5 0 0 -0.02\n9 1 1 1\n$ENDNOD\n"
         "$ELM\n3\n1 2 0 1 3 1 2 4\n2 4 0 1 4 1 2 4 7\n3 4 0 1 4 1 2 4 5\n$ENDELM\n";
}

// The first tetrahedron belongs to two physical groups.
std::string version_2() {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "
         "\"organ\"\n$EndPhysicalNames\n"
         "$Nodes\n6\n1 0 0 0\n2 0.02 0 0\n4 0 0.02 0\n7 0 0 0.02\n5 0 0 -0.02\n9 1 1 1\n$EndNodes\n"
         "$Elements\n4\n1 2 2 0 1 1 2 4\n2 4 2 1 1 1 2 4 7\n3 4 2 2 1 1 2 4 7\n"
         "4 4 2 1 1 1 2 4 5\n$EndElements\n";
}

/// Bytes of a binary file, little-endian.
class Binary {
 public:
  explicit Binary(const std::string& version) {
    text("$MeshFormat\n" + version + " 1 8\n").ints({1}).text("\n$EndMeshFormat\n");
  }
  Binary& text(const std::string& more) {
    bytes_ += more;
    return *this;
  }
  Binary& ints(const std::vector<std::uint32_t>& all) {
    for (const std::uint32_t value : all) append(value, 4);
    return *this;
  }
  Binary& sizes(const std::vector<std::uint64_t>& all) {
    for (const std::uint64_t value : all) append(value, 8);
    return *this;
  }
  Binary& place(double x, double y, double z) {
    for (const double value : {x, y, z}) append(std::bit_cast<std::uint64_t>(value), 8);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void append(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 255U);
  }
  std::string bytes_;
};

std::string binary_2() {
  Binary file("2.2");
  file.text("$Nodes\n6\n").ints({1}).place(0, 0, 0).ints({2}).place(0.02, 0, 0);
  file.ints({4}).place(0, 0.02, 0).ints({7}).place(0, 0, 0.02).ints({5}).place(0, 0, -0.02);
  file.ints({9}).place(1, 1, 1).text("\n$EndNodes\n$Elements\n3\n");
  file.ints({2, 1, 2, 1, 0, 1, 1, 2, 4});
  file.ints({4, 2, 2, 2, 1, 1, 1, 2, 4, 7, 3, 1, 1, 1, 2, 4, 5}).text("\n$EndElements\n");
  return file.bytes();
}

std::string binary_4() {
  Binary file("4.1");
  file.text("$Entities\n").sizes({0, 0, 0, 0}).text("\n$EndEntities\n$Nodes\n").sizes({2, 6, 1, 9});
  file.ints({2, 1, 0}).sizes({3, 1, 2, 4}).place(0, 0, 0).place(0.02, 0, 0).place(0, 0.02, 0);
  file.ints({3, 1, 0}).sizes({3, 7, 5, 9}).place(0, 0, 0.02).place(0, 0, -0.02).place(1, 1, 1);
  file.text("\n$EndNodes\n$Elements\n").sizes({2, 3, 1, 3});
  file.ints({2, 1, 2}).sizes({1, 1, 1, 2, 4});
  file.ints({3, 1, 4}).sizes({2, 2, 1, 2, 4, 7, 3, 1, 2, 4, 5}).text("\n$EndElements\n");
  return file.bytes();
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

TEST(GmshFile, EveryVersionGivesTheSameSolid) {
  const SolidMesh expected = read_gmsh("organ.msh", two_tetrahedra());
  for (const std::string& text : {version_1(), version_2(), binary_2(), binary_4()}) {
    const SolidMesh mesh = read_gmsh("organ.msh", text);
    EXPECT_EQ(mesh.nodes, expected.nodes) << text;
    EXPECT_EQ(mesh.tetrahedra, expected.tetrahedra) << text;
  }
}

TEST(GmshFile, NamesBytesOfBinaryFaults) {
  const std::string two = binary_2(), four = binary_4();
  const auto inside = [](const std::string& text, const char* before, std::size_t skip) {
    return text.find(before) + std::string(before).size() + skip;
  };
  std::string bad = two;
  bad[inside(two, "$Nodes\n6\n", 4 + 6)] = '\xf0';
  bad[inside(two, "$Nodes\n6\n", 4 + 7)] = '\x7f';  // x is infinite
  expect_fault(bad, "byte 53", "three finite coordinates");
  bad = two;
  bad[inside(two, "$Elements\n3\n", 36)] = '\x05';  // hexahedra
  expect_fault(bad, "byte " + std::to_string(inside(two, "$Elements\n3\n", 36)), "tetrahedra");
  bad = four;
  const std::size_t second = inside(four, "$Elements\n", 32 + 20 + 32 + 20 + 40);
  bad[second + 8] = '\x63';  // its first node
  expect_fault(bad, "byte " + std::to_string(second), "a node of $Nodes");
  expect_fault(with(two, std::string("\x01\0\0\0\n$End", 9), std::string("\0\0\0\x01\n$End", 9)),
               "byte ", "little-endian");
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
  expect_fault(with(good, "4.1 0 8", "4 0 8"), "line 2", "version 1, 2 to 2.2 or 4.1");
  expect_fault(with(good, "4.1 0 8", "4.1 2 8"), "line 2", "ASCII");
  expect_fault(with(good, "4.1 0 8", "4.1 0 4"), "line 2", "numbers of 8 bytes");
  expect_fault(with(version_1(), "2 4 0 1 4 1 2 4 7", "2 4 0 1 4 1 2 4"), "line 13",
               "a tetrahedron of four nodes");
  expect_fault(with(version_2(), "2 4 2 1", "2 5 2 1"), "line 20", "tetrahedra");
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
  for (const std::string& good :
       {two_tetrahedra(), version_1(), version_2(), binary_2(), binary_4()}) {
    for (std::size_t length = 0; length + 2 < good.size(); ++length)
      EXPECT_THROW(read_gmsh("cut.msh", good.substr(0, length)), MeshError) << length;
  }
}

}  // namespace
}  // namespace palpate::stimuli
