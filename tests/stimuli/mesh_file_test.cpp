#include "stimuli/mesh_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <clocale>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <limits>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/shared/temporary_folder.h"
#include "tests/stimuli/single_precision.h"

namespace palpate::stimuli {
namespace {

using testing::placed;
using testing::triangulated;

class MeshFile : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  PolygonSoup read(const std::string& name, const std::string& bytes) const {
    return read_mesh_file(write(name, bytes));
  }

  std::vector<std::string> faults(const std::string& name, const std::string& bytes) const {
    try {
      read(name, bytes);
    } catch (const MeshError& error) {
      for (const std::string& fault : error.faults()) {
        EXPECT_TRUE(fault.starts_with((folder_ / name) + ": ")) << fault;
      }
      return error.faults();
    }
    return {};
  }

  void expect_fault(const std::string& name, const std::string& bytes,
                    const std::string& text) const {
    const std::vector<std::string> found = faults(name, bytes);
    EXPECT_TRUE(std::any_of(
        found.begin(), found.end(),
        [&](const std::string& fault) { return fault.find(text) != std::string::npos; }))
        << "expected " << text << " in " << ::testing::PrintToString(found);
  }

  const testing::TemporaryFolder folder_;
};

std::string printed(const char* format, double value) {
  std::array<char, 400> text{};
  const int length = std::snprintf(text.data(), text.size(), format, value);
  return {text.data(), static_cast<std::size_t>(length)};
}

std::string place_text(const Vec3& place, const char* format) {
  return " " + printed(format, place.x) + " " + printed(format, place.y) + " " +
         printed(format, place.z) + "\n";
}

std::string as_obj(const PolygonSoup& soup, const char* format = "%.17g") {
  std::string text = "# a mesh\no thing\n";
  for (const Vec3& vertex : soup.vertices) text += "v" + place_text(vertex, format);
  for (const auto& face : soup.faces) {
    text += "f";
    for (const std::uint32_t v : face) text += " " + std::to_string(v + 1);
    text += "\n";
  }
  return text;
}

std::string as_ascii_stl(const PolygonSoup& soup, const char* format = "%.17g") {
  std::string text = "solid thing with a name\n";
  for (const auto& face : soup.faces) {
    text += "facet normal nan 0 0\n  outer loop\n";
    for (const std::uint32_t v : face) text += "    vertex" + place_text(soup.vertices[v], format);
    text += "  endloop\nendfacet\n";
  }
  return text + "endsolid thing with a name\n";
}

std::string word_bytes(std::uint32_t word) {
  std::string bytes;
  for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>(word >> (8 * i) & 0xffU);
  return bytes;
}

std::string as_binary_stl(const PolygonSoup& soup, std::string header = "solid not really") {
  header.resize(80, ' ');
  std::string bytes = header + word_bytes(static_cast<std::uint32_t>(soup.faces.size()));
  for (const auto& face : soup.faces) {
    bytes += std::string(12, '\0');
    for (const std::uint32_t v : face) {
      for (int axis = 0; axis < 3; ++axis) {
        bytes +=
            word_bytes(std::bit_cast<std::uint32_t>(static_cast<float>(soup.vertices[v][axis])));
      }
    }
    bytes += std::string(2, '\0');
  }
  return bytes;
}

std::size_t facets_of(const PolygonSoup& soup) { return ConvexMesh(soup).facets().size(); }

TEST_F(MeshFile, RefusesTooLargeFilesBeforeReadingThem) {
  const std::string path = write("huge.stl", "");
  std::filesystem::resize_file(path, (std::uintmax_t{1} << 31) + 1);  // uses no disk space
  try {
    read_mesh_file(path);
    FAIL();
  } catch (const MeshError& error) {
    EXPECT_STREQ(error.what(),
                 (path + ": expected a file of at most 2 GiB, found 2147483649").c_str());
  }
}

TEST_F(MeshFile, ReadsWhatWasWritten) {
  const PolygonSoup soup = triangulated(cube(0.06));
  const PolygonSoup obj = read("cube.obj", as_obj(soup));
  EXPECT_EQ(obj.vertices, soup.vertices);
  EXPECT_EQ(obj.faces, soup.faces);
  const PolygonSoup ascii = read("cube.stl", as_ascii_stl(soup));
  const PolygonSoup binary = read("cube2.STL", as_binary_stl(soup));
  ASSERT_EQ(ascii.faces.size(), 12U);
  ASSERT_EQ(binary.faces.size(), 12U);
  for (std::size_t f = 0; f < 12; ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 written = soup.vertices[soup.faces[f][k]];
      EXPECT_EQ(ascii.vertices[ascii.faces[f][k]], written);
      EXPECT_EQ(binary.vertices[binary.faces[f][k]], checks::single_precision(written));
    }
  }
}

TEST_F(MeshFile, TriangulatedCubeHasSixFacetsInEveryFormat) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (int i = 0; i < 30; ++i) {
    const PolygonSoup soup =
        placed(triangulated(cube(0.06)), uniform_rotation(random), 1, Vec3(0.1, 0.2, -0.1));
    EXPECT_EQ(facets_of(read("c.stl", as_binary_stl(soup))), 6U);
    for (const char* format : {"%.17g", "%.9g", "%g", "%f"}) {
      EXPECT_EQ(facets_of(read("c.stl", as_ascii_stl(soup, format))), 6U) << format;
      EXPECT_EQ(facets_of(read("c.obj", as_obj(soup, format))), 6U) << format;
    }
  }
}

TEST_F(MeshFile, RoundObjectsSurviveTheDigitsOfTheirFiles) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (int i = 0; i < 5; ++i) {
    const Quat turn = uniform_rotation(random);
    const PolygonSoup sphere = placed(icosphere(0.03, 3), turn, 1, Vec3(0.01));
    const PolygonSoup rod = placed(triangulated(cylinder(0.03, 0.06, 64)), turn, 1, Vec3(0.01));
    for (const char* format : {"%.17g", "%.9g", "%g", "%f"}) {
      EXPECT_EQ(facets_of(read("s.obj", as_obj(sphere, format))), 1280U) << format;
      EXPECT_EQ(facets_of(read("r.obj", as_obj(rod, format))), 66U) << format;
      EXPECT_EQ(facets_of(read("r.stl", as_ascii_stl(rod, format))), 66U) << format;
    }
    EXPECT_EQ(facets_of(read("s.stl", as_binary_stl(sphere))), 1280U);
    EXPECT_EQ(facets_of(read("r.stl", as_binary_stl(rod))), 66U);
  }
}

TEST_F(MeshFile, NeedlesKeepTheirSidesGivenEnoughDigits) {
  const PolygonSoup soup =
      placed(triangulated(testing::prism(64, 5e-7, 1)), Quat(0.8, 0.36, 0.48, 0), 1, Vec3(0));
  EXPECT_EQ(facets_of(read("needle.obj", as_obj(soup))), 66U);
}

TEST_F(MeshFile, GivesThePrecisionOfNumbers) {
  const auto error = [&](const std::string& numbers) {
    return read("e.obj", "v " + numbers + "\nf 1 1 1\n").coordinate_error;
  };
  EXPECT_EQ(error("0.123456 0.500000 0.000001"), 0.5e-6);               // %f: half the last place
  EXPECT_NEAR(error("0.123456 0.5 0.0125"), 0.5e-6, 1e-12);             // %g: six digits
  EXPECT_NEAR(error("12.3456789012 0.5 0.0125"), 0.5e-10, 1e-16);       // twelve digits
  EXPECT_NEAR(error("1234.5678 0.5 0.01"), 1234.5678 * 0x1p-24, 1e-9);  // %.8g of a float
  EXPECT_NEAR(error("0.1 0.05 0"), 0.5e-6, 1e-12);                      // by hand
  EXPECT_NEAR(error("0.0010 0.0000 0.0005"), 1e-7, 1e-12);              // never above 1e-4 of it
  EXPECT_LT(error("0.12345678901234567 0 0"), 1e-16);
  const double single = static_cast<float>(0.1);
  EXPECT_NEAR(error(printed("%.17g", single) + " 0 0"), single * 0x1p-24, 1e-15);
}

TEST_F(MeshFile, ReadsTheFormsOfObj) {
  const std::string head = "mtllib a.mtl\r\nv +0 0 0\r\nv 1e0 0 0 1.0\r\n  v\t0 1 0 0.5 0.5 0.5\n";
  const std::vector<std::uint32_t> expected{0, 1, 2};
  for (const char* face : {"f 1 2 3", "f 1/1 2/2 3/3\r", "f 1//1 2//1 3//1 # c",
                           "f 1/2/3 2/3/4 3/4/5", "f -3 -2 -1", "f 1 2 \\\n3", "s off\nf 1 2 3"}) {
    const PolygonSoup soup = read("a.obj", head + face);
    ASSERT_EQ(soup.vertices.size(), 3U);
    EXPECT_EQ(soup.vertices[1], Vec3(1, 0, 0));
    EXPECT_EQ(soup.vertices[2], Vec3(0, 1, 0));
    ASSERT_EQ(soup.faces.size(), 1U) << face;
    EXPECT_EQ(soup.faces[0], expected) << face;
  }
}

TEST_F(MeshFile, AnyLineEndingOfAnObjIsRead) {
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 \\\n4";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : obj) text += c == '\n' ? end : std::string(1, c);
    EXPECT_EQ(facets_of(read("a.obj", text)), 4U);
    expect_fault("a.obj", text + end + "f 1 2 9", ": line 10: expected vertex numbers up to 4");
  }
}

TEST_F(MeshFile, AnyLineEndingOfAnStlIsRead) {
  const std::string stl = as_ascii_stl(triangulated(cube(0.06)));
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : stl) text += c == '\n' ? end : std::string(1, c);
    EXPECT_EQ(facets_of(read("a.stl", text)), 6U);
    expect_fault("a.stl", "solid s" + end + "facet" + end + "x", ": line 3: expected normal");
  }
}

TEST_F(MeshFile, AByteOrderMarkHidesNothing) {
  const std::string mark = "\xEF\xBB\xBF";
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const PolygonSoup marked = read("marked.obj", mark + obj), plain = read("plain.obj", obj);
  EXPECT_EQ(marked.vertices, plain.vertices);
  EXPECT_EQ(marked.faces, plain.faces);
  const std::string stl =
      "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
      "vertex 0 1 0\nendloop\nendfacet\nendsolid s\n";
  EXPECT_EQ(read("marked.stl", mark + stl).vertices, read("plain.stl", stl).vertices);
}

TEST_F(MeshFile, ObjFaultsNameTheLine) {
  const std::string head = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  expect_fault("a.obj", head + "v 1 x 0\nf 1 2 3", ": line 4: expected three finite coordinates");
  expect_fault("a.obj", head + "v 1 x 0\nf 1 2 3", "found \"x\"");
  expect_fault("a.obj", head + "v 1 2\nf 1 2 3", "found the end of the line");
  expect_fault("a.obj", head + "v 1 2 nan\nf 1 2 3", ": line 4:");
  expect_fault("a.obj", head + "v 1 2 1e999\nf 1 2 3", ": line 4:");
  expect_fault("a.obj", head + "v 1 2 1,5\nf 1 2 3", "\"1,5\"");
  expect_fault("a.obj", head + "f 1 2", ": line 4: expected three or more corners");
  expect_fault("a.obj", head + "f 1 2 0", ": line 4: expected vertex numbers from 1");
  expect_fault("a.obj", head + "f 1 2 -4", ": line 4: expected vertex numbers from -3");
  expect_fault("a.obj", head + "f 1 2 4", ": line 4: expected vertex numbers up to 3, found \"4\"");
  expect_fault("a.obj", head + "f 1 2 99999999999999999999", ": line 4:");
  expect_fault("a.obj", head + "f 1 2 3x", "\"3x\"");
  expect_fault("a.obj", head + "# a\\\nb\nf 1 2 4", ": line 6:");
  expect_fault("a.obj", head + "# C:\\parts\\\nf 1 2 4",
               ": line 5: expected vertex numbers up to 3");
  expect_fault("a.obj", head, "at least one f statement, found none");
  expect_fault("a.obj", "", "at least one f statement, found none");
}

TEST_F(MeshFile, ListsAllFaultsUpToALimit) {
  EXPECT_EQ(faults("a.obj", "v a\nv b\nf 1\nv 0 0 0\nf 1 2 9\n").size(), 4U);
  std::string many = "f 1 1 1\n";
  for (int i = 0; i < 100; ++i) many += "v nan\n";
  const std::vector<std::string> found = faults("a.obj", many);
  ASSERT_EQ(found.size(), 21U);
  EXPECT_NE(found.back().find("80 more faults"), std::string::npos);
}

TEST_F(MeshFile, AsciiStlFaultsNameTheLine) {
  const std::string good = as_ascii_stl(triangulated(cube(1)));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string bad = good;
    return bad.replace(bad.find(from), from.size(), to);
  };
  expect_fault("a.stl", with("vertex -0.5", "vertex what"), ": line 4: expected three finite");
  expect_fault("a.stl", with("vertex", "vertices"), ": line 4: expected vertex");
  expect_fault("a.stl", with("endloop", "vertex 0 0 0\nendloop"), ": line 7: expected endloop");
  expect_fault("a.stl", with("outer", "inner"), ": line 3: expected outer");
  expect_fault("a.stl", with("endfacet", ""), ": line 9: expected endfacet, found \"facet\"");
  expect_fault("a.stl", good.substr(0, 200), "found the end of the file");
  EXPECT_EQ(read("a.stl", good + "more\nand more").faces.size(), 12U);
  expect_fault("a.stl", "solid a\nmore\n", "expected facet or endsolid");
  expect_fault("a.stl", "solid a\nendsolid a\n", "at least one triangle");
  EXPECT_EQ(read("a.stl", with("facet", "FACET")).faces.size(), 12U);
}

TEST_F(MeshFile, BinaryStlMustHaveTheTrianglesItClaims) {
  const std::string good = as_binary_stl(triangulated(cube(1)), "x");
  for (const std::string header : {"x", "solid x"}) {
    std::string bytes = as_binary_stl(triangulated(cube(1)), header);
    EXPECT_EQ(read("a.stl", bytes).faces.size(), 12U);
    EXPECT_EQ(read("a.stl", bytes + "x").faces.size(), 12U);
    expect_fault("a.stl", bytes.substr(0, 600), "found 600 bytes");
    bytes.replace(80, 4, word_bytes(0xffffffff));
    expect_fault("a.stl", bytes, "for 4294967295 triangles");
  }
  expect_fault("a.stl", good.substr(0, 50), "expected a binary header of 84 bytes");
  expect_fault("a.stl", "", "found 0 other bytes");
  expect_fault("a.stl", std::string(80, ' ') + word_bytes(0), "at least one triangle");
  std::string nan = good;
  nan.replace(84 + 50 + 12, 4, word_bytes(0x7fc00000));
  expect_fault("a.stl", nan, ": byte 146: expected three finite coordinates");
}

class MeshFileSurface : public MeshFile {
 protected:
  /// The faults of the surface that a file describes.
  std::string surface_fault(const std::string& name, const std::string& bytes) const {
    try {
      const ConvexMesh mesh(read(name, bytes));
      return "none";
    } catch (const MeshError& error) {
      return error.what();
    }
  }
};

TEST_F(MeshFileSurface, ObjFaultsNameItsNumbersAndLines) {
  const std::string corners = "# a tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  EXPECT_EQ(surface_fault("a.obj", corners + "f 1 3 2\nf 1 2 4\n\nf 1 4 3\nf 2 3 4\n"), "none");
  const std::string open = surface_fault("a.obj", corners + "f 1 3 2\nf 1 2 4\n\nf 1 4 3\n");
  EXPECT_EQ(open.rfind("open: edge 3-2 of face 1 at line 6 (vertices 1 3 2) has", 0), 0U) << open;
  const std::string turned =
      surface_fault("a.obj", corners + "f 1 3 2\nf 1 2 4\n\nf 1 3 4\nf 2 3 4\n");
  EXPECT_NE(turned.find("turned face: edge 1-3 of face 3 at line 9 (vertices 1 3 4) runs the same "
                        "way in face 1 at line 6 (vertices 1 3 2)"),
            std::string::npos)
      << turned;
  EXPECT_EQ(surface_fault("a.obj", "\nv 1e31 0 0\n" + corners + "f 1 2 3"),
            "not finite: vertex 1 at line 2: expected three finite coordinates (up to 1e30 m)");
  // Corners at one place keep the numbers that the face gives them.
  const std::string own = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0 0 1\nv 1 0 0\n";
  const std::string fault = surface_fault("a.obj", own + "f 1 3 2\nf 4 6 5\n");
  EXPECT_NE(fault.find("open: edge 6-5 of face 2 at line 8 (vertices 4 6 5)"), std::string::npos)
      << fault;
}

TEST_F(MeshFileSurface, StlFaultsNameItsPlacesAndCoordinates) {
  PolygonSoup soup = triangulated(cube(1));
  soup.faces.pop_back();
  const std::string ascii = surface_fault("a.stl", as_ascii_stl(soup));
  EXPECT_EQ(ascii.rfind("open: edge (", 0), 0U) << ascii;
  EXPECT_NE(ascii.find(") of face "), std::string::npos) << ascii;
  // Each facet takes seven lines, after the first; or 50 bytes, after 84.
  const auto number_of = [](const std::string& text) {
    return std::stoul(text.substr(text.find("of face ") + 8));
  };
  EXPECT_NE(
      ascii.find(" at line " + std::to_string(2 + 7 * (number_of(ascii) - 1)) + " (vertices ("),
      std::string::npos)
      << ascii;
  const std::string binary = surface_fault("b.stl", as_binary_stl(soup));
  EXPECT_NE(
      binary.find(" at byte " + std::to_string(84 + 50 * (number_of(binary) - 1)) + " (vertices ("),
      std::string::npos)
      << binary;
}

TEST_F(MeshFile, OtherFilesAreRefused) {
  expect_fault("a.3ds", "ply", ".obj, .stl, .gltf, .glb, .ply, .off or .3mf");
  EXPECT_THROW(read_mesh_file(folder_ / "none.obj"), MeshError);
  std::filesystem::create_directory(folder_ / "folder.stl");
  EXPECT_THROW(read_mesh_file(folder_ / "folder.stl"), MeshError);
  EXPECT_THROW(read_mesh_file("/dev/null"), MeshError);
  EXPECT_THROW(read_mesh_file(""), MeshError);
}

// Damaged files give only a soup or a MeshError.
TEST_F(MeshFile, DamagedFilesNeverCrash) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  const PolygonSoup soup = triangulated(cube(0.06));
  const std::array<std::pair<std::string, std::string>, 3> files{
      {{"a.obj", as_obj(soup)}, {"b.stl", as_ascii_stl(soup)}, {"c.stl", as_binary_stl(soup)}}};
  for (int i = 0; i < 800; ++i) {
    auto [name, bytes] = files.at(random.below(3));
    for (std::uint64_t damage = 1 + random.below(5); damage > 0 && !bytes.empty(); --damage) {
      const std::size_t at = random.below(bytes.size());
      switch (random.below(4)) {
        case 0:
          bytes[at] = static_cast<char>(random.below(256));
          break;
        case 1:
          bytes.erase(at, random.below(20));
          break;
        case 2:
          bytes.insert(at, bytes.substr(random.below(bytes.size()), random.below(30)));
          break;
        default:
          bytes.resize(std::max<std::size_t>(at, 1));
      }
    }
    try {
      const ConvexMesh mesh(read(name, bytes));
    } catch (const MeshError& error) {
      EXPECT_FALSE(error.faults().empty());
    }
  }
}

TEST_F(MeshFile, OnlyA3mfFileNamesItsUnit) {
  EXPECT_TRUE(has_unit("parts/cup.3mf"));
  EXPECT_TRUE(has_unit("CUP.3MF"));
  EXPECT_FALSE(has_unit("cup.stl"));
  EXPECT_FALSE(has_unit("3mf"));
}

}  // namespace
}  // namespace palpate::stimuli
