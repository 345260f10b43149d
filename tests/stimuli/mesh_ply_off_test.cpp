#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>
#include <string>

#include "stimuli/mesh_file.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::stimuli {
namespace {

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

// A cube of quadrilaterals, with extra values beside coordinates and corners in every line.
std::string ascii_ply(const PolygonSoup& soup, const std::string& end = "\n") {
  std::string text = "ply" + end + "format ascii 1.0" + end + "comment made by a test" + end +
                     "obj_info of nothing" + end + "element vertex " +
                     std::to_string(soup.vertices.size()) + end;
  for (const char* name : {"nx", "x", "y", "z"}) text += "property float " + (name + end);
  text += "element face " + std::to_string(soup.faces.size()) + end + "property uchar quality" +
          end + "property list uchar int vertex_indices" + end +
          "property list uchar float texcoord" + end + "element edge 1" + end +
          "property int vertex1" + end + "end_header" + end;
  for (const Vec3& v : soup.vertices)
    text += "0.5 " + number(v.x) + " " + number(v.y) + " " + number(v.z) + end;
  for (const auto& face : soup.faces) {
    text += "9 " + std::to_string(face.size());
    for (const std::uint32_t v : face) text += " " + std::to_string(v);
    text += " 2 0.5 0.5" + end;
  }
  return text + "3" + end;
}

std::string bytes_of(std::uint64_t word, std::size_t size, bool big) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i)
    bytes += static_cast<char>(word >> (8 * (big ? size - 1 - i : i)) & 0xffU);
  return bytes;
}

std::string binary_ply(const PolygonSoup& soup, bool big, bool single) {
  const std::string real = single ? "float" : "double";
  std::string bytes = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                      "_endian 1.0\nelement vertex " + std::to_string(soup.vertices.size()) +
                      "\nproperty list uchar short extra\nproperty " + real + " x\nproperty " +
                      real + " y\nproperty " + real + " z\nelement face " +
                      std::to_string(soup.faces.size()) +
                      "\nproperty list ushort uint vertex_index\nproperty char c\nend_header\n";
  for (const Vec3& v : soup.vertices) {
    bytes += bytes_of(2, 1, big) + bytes_of(13, 2, big) + bytes_of(0xffff, 2, big);
    for (int axis = 0; axis < 3; ++axis) {
      bytes += single ? bytes_of(std::bit_cast<std::uint32_t>(static_cast<float>(v[axis])), 4, big)
                      : bytes_of(std::bit_cast<std::uint64_t>(v[axis]), 8, big);
    }
  }
  for (const auto& face : soup.faces) {
    bytes += bytes_of(face.size(), 2, big);
    for (const std::uint32_t v : face) bytes += bytes_of(v, 4, big);
    bytes += bytes_of(255, 1, big);
  }
  return bytes;
}

void expect_same(const PolygonSoup& read, const PolygonSoup& soup, double within) {
  EXPECT_EQ(read.faces, soup.faces);
  ASSERT_EQ(read.vertices.size(), soup.vertices.size());
  for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(read.vertices[v][axis], soup.vertices[v][axis], within);
  }
}

std::string fault_in(const std::string& name, const std::string& bytes) {
  try {
    read_mesh(name, bytes);
  } catch (const MeshError& error) {
    EXPECT_EQ(error.faults()[0].rfind(name + ": ", 0), 0U) << error.what();
    return error.what();
  }
  return "";
}

std::string exchanged(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class PlyFile : public ::testing::Test {
 protected:
  const PolygonSoup soup_ = cube(0.06);
  const std::string text_ = ascii_ply(soup_);
};

TEST_F(PlyFile, EveryEncodingGivesTheSameMesh) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    expect_same(read_mesh("a.ply", ascii_ply(soup_, end)), soup_, 1e-9);
    expect_same(read_mesh("a.ply", "\xEF\xBB\xBF" + ascii_ply(soup_, end)), soup_, 1e-9);
  }
  for (const bool big : {false, true}) {
    const PolygonSoup single = read_mesh("a.ply", binary_ply(soup_, big, true));
    expect_same(single, soup_, 2e-9);
    EXPECT_DOUBLE_EQ(single.coordinate_error, static_cast<double>(0.03F) * 0x1p-24);
    const PolygonSoup exact = read_mesh("a.ply", binary_ply(soup_, big, false));
    expect_same(exact, soup_, 0);
    EXPECT_EQ(exact.coordinate_error, 0);
  }
}

TEST_F(PlyFile, DataAfterTheLastElementIsSkipped) {
  expect_same(read_mesh("a.ply", text_ + std::string("\0 more", 6)), soup_, 1e-9);
  expect_same(read_mesh("a.ply", binary_ply(soup_, true, false) + "abc"), soup_, 0);
}

TEST_F(PlyFile, AFileCutShortAnywhereIsRefused) {
  for (const bool big : {false, true}) {
    const std::string bytes = binary_ply(soup_, big, true);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_NE(fault_in("a.ply", bytes.substr(0, size)), "") << size;
  }
  EXPECT_NE(fault_in("a.ply", text_.substr(0, text_.size() / 2)), "");
}

TEST_F(PlyFile, FaultsNameTheLine) {
  // The header has 16 lines, then come 8 corners.
  EXPECT_EQ(fault_in("a.ply", exchanged(text_, "9 4 ", "9 2 ")),
            "a.ply: line 25: expected three or more corners of a face, found 2");
  EXPECT_EQ(fault_in("a.ply", exchanged(text_, "0.5 " + number(soup_.vertices[0].x), "0.5 nan")),
            "a.ply: line 17: expected three finite coordinates, found \"nan\"");
  EXPECT_EQ(
      fault_in("a.ply", exchanged(text_, "9 4 " + std::to_string(soup_.faces[0][0]), "9 4 8")),
      "a.ply: line 25: expected vertex numbers from 0 to 7, found \"8\"");
  EXPECT_EQ(fault_in("a.ply", exchanged(text_, "9 4 ", "9 40 ")),
            "a.ply: line 25: expected the length of the list vertex_indices and as many numbers, "
            "found \"40\"");
}

TEST_F(PlyFile, HeadersWithoutASurfaceAreRefused) {
  EXPECT_NE(fault_in("a.ply", "").find("line 1: expected \"ply\""), std::string::npos);
  EXPECT_NE(fault_in("a.ply", exchanged(text_, "ascii", "utf")).find("line 2: expected ascii"),
            std::string::npos);
  EXPECT_NE(
      fault_in("a.ply", exchanged(text_, "float y", "float yy")).find("a property y of vertex"),
      std::string::npos);
  EXPECT_NE(fault_in("a.ply", exchanged(text_, "vertex_indices", "corners"))
                .find("a property list vertex_indices"),
            std::string::npos);
  EXPECT_NE(fault_in("a.ply", exchanged(text_, "element face", "element facet"))
                .find("a cloud of points is no surface"),
            std::string::npos);
  EXPECT_NE(fault_in("a.ply", exchanged(text_, "float y", "real y")).find("a type of PLY"),
            std::string::npos);
  EXPECT_NE(fault_in("a.ply", exchanged(text_, "vertex 8", "vertex 4000000000")).find("2^31"),
            std::string::npos);
  EXPECT_NE(fault_in("a.ply", exchanged(text_, "end_header", "end")), "");
}

std::string off(const PolygonSoup& soup, const std::string& head, const std::string& vertex_rest,
                const std::string& face_rest, const std::string& end = "\n") {
  std::string text = head + std::to_string(soup.vertices.size()) + " " +
                     std::to_string(soup.faces.size()) + " 0" + end;
  for (const Vec3& v : soup.vertices)
    text += number(v.x) + " " + number(v.y) + " " + number(v.z) + vertex_rest + end;
  text += "# faces" + end + end;
  for (const auto& face : soup.faces) {
    text += std::to_string(face.size());
    for (const std::uint32_t v : face) text += " " + std::to_string(v);
    text += face_rest + end;
  }
  return text;
}

TEST(OffFile, EveryKindOfTextGivesTheSameMesh) {
  const PolygonSoup soup = cube(0.06);
  for (const std::string& text :
       {off(soup, "OFF\n", "", ""), off(soup, "# by hand\nOFF # of a cube\n\n", "", " # one"),
        off(soup, "OFF ", "", ""), off(soup, "", "", ""), off(soup, "OFF\n", "", " 255 0 0"),
        off(soup, "COFF\n", " 1 0 0 1", " 3"), off(soup, "NOFF\n", " 0 0 1", ""),
        off(soup, "STCNOFF\n", " 0 0 1 1 0 0 1 .5 .5", ""), off(soup, "OFF\r\n", "", "", "\r\n"),
        off(soup, "OFF\r", "", "", "\r"), "\xEF\xBB\xBF" + off(soup, "OFF\n", "", ""),
        off(soup, "OFF\n", "", "") + "and more"})
    expect_same(read_mesh("a.off", text), soup, 1e-9);
}

TEST_F(PlyFile, AnElementMustNotBeGivenTwice) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement face 0\nproperty list uchar int vertex_indices\n"
      "element face 1\nproperty int a\nend_header\n0 0 0\n3 0 0 0\n";
  EXPECT_EQ(fault_in("a.ply", text), "a.ply: expected one element face in the header, found 2");
}

TEST(OffFile, FaultsNameTheLine) {
  const PolygonSoup soup = cube(0.06);
  const std::string text = off(soup, "OFF\n", "", "");
  EXPECT_NE(fault_in("a.off", ""), "");
  EXPECT_NE(fault_in("a.off", "OFF BINARY\n").find("OFF as text"), std::string::npos);
  EXPECT_NE(fault_in("a.off", "4" + text).find("in three dimensions, found \"4OFF\""),
            std::string::npos);
  EXPECT_NE(fault_in("a.off", "solid a").find("line 1: expected OFF"), std::string::npos);
  EXPECT_NE(fault_in("a.off", "OFF\n0 0 0\n").find("at least one vertex"), std::string::npos);
  const std::string first = "\n4 " + std::to_string(soup.faces[0][0]);
  EXPECT_NE(fault_in("a.off", exchanged(text, first, "\n4 8"))
                .find("line 13: expected vertex numbers from 0 to 7, found \"8\""),
            std::string::npos);
  EXPECT_NE(fault_in("a.off", exchanged(text, first, "\n5" + first.substr(2))).find("line 13"),
            std::string::npos);
  EXPECT_NE(fault_in("a.off", text.substr(0, text.find("\n4 ") + 1))
                .find("expected 6 lines of faces, found the end of the file after 0"),
            std::string::npos);
  EXPECT_NE(fault_in("a.off", exchanged(text, number(soup.vertices[0].x), "x"))
                .find("line 3: expected three finite coordinates, found \"x\""),
            std::string::npos);
}

}  // namespace
}  // namespace palpate::stimuli
