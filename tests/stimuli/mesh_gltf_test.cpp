#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <string>

#include "stimuli/base64.h"
#include "stimuli/mesh_file.h"
#include "stimuli/parts/convex_parts.h"

namespace palpate::stimuli {
namespace {

void append(std::string& bytes, std::uint32_t word, int size = 4) {
  for (int b = 0; b < size; ++b) bytes += static_cast<char>(word >> (8 * b) & 255U);
}

// A box of 0.02 x 0.04 x 0.06 m, as a file would hold it: x, y up, z towards the viewer.
constexpr float kHalf[3] = {0.01F, 0.02F, 0.03F};

std::string box_buffer() {
  std::string bytes;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      const float value = (corner >> axis & 1) != 0 ? kHalf[axis] : -kHalf[axis];
      append(bytes, std::bit_cast<std::uint32_t>(value));
    }
  }
  constexpr int kTriangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                     {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                     {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  for (const auto& triangle : kTriangles) {
    for (const int corner : triangle) append(bytes, static_cast<std::uint32_t>(corner), 2);
  }
  return bytes;
}

std::string document(const std::string& nodes, const std::string& uri,
                     const std::string& more = "") {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": )" +
         nodes + R"(, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
   "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
                 {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
   "bufferViews": [{"buffer": 0, "byteLength": 96},
                   {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
   "buffers": [{"byteLength": 168)" +
         (uri.empty() ? "" : R"(, "uri": ")" + uri + "\"") + "}]" + more + "}";
}

std::string inside() {
  return "data:application/octet-stream;base64," + base64_encoded(box_buffer());
}

Vec3 extent(const PolygonSoup& soup) {
  Vec3 low = soup.vertices.at(0), high = low;
  for (const Vec3& vertex : soup.vertices) {
    low = glm::min(low, vertex);
    high = glm::max(high, vertex);
  }
  return high - low;
}

void expect_box(const PolygonSoup& soup, const Vec3& size, const Vec3& centre) {
  const std::vector<ConvexMesh> parts = convex_parts(soup);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_LT(glm::length(extent(soup) - size), 1e-8);
  EXPECT_LT(glm::length(parts[0].centre() - centre), 1e-8);
}

TEST(MeshGltf, UpIsTurnedFromYToZ) {
  const PolygonSoup soup = read_mesh("box.gltf", document(R"([{"mesh": 0}])", inside()));
  expect_box(soup, Vec3(0.02, 0.06, 0.04), Vec3(0));
}

TEST(MeshGltf, TransformsOfNodesWithinNodesApply) {
  // Scaled, turned by 90 degrees about y, moved; then the outer node moves and mirrors it.
  const std::string nodes = R"([{"children": [1], "scale": [-1, 1, 1], "translation": [0, 0.5, 0]},
    {"mesh": 0, "scale": [2, 1, 1], "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476],
     "translation": [0.1, 0, 0.3]}])";
  // x: 2 * 0.02 becomes z, z becomes x; then (x, y, z) = (-0.1, 0.5, 0.3), in our frame (x, -z, y).
  expect_box(read_mesh("box.gltf", document(nodes, inside())), Vec3(0.06, 0.04, 0.04),
             Vec3(-0.1, -0.3, 0.5));
  const std::string matrix =
      R"([{"mesh": 0, "matrix": [0,0,-2,0, 0,1,0,0, 1,0,0,0, 0.1,0.2,0.3,1]}])";
  expect_box(read_mesh("box.gltf", document(matrix, inside())), Vec3(0.06, 0.04, 0.04),
             Vec3(0.1, -0.3, 0.2));
}

TEST(MeshGltf, AMeshUsedTwiceIsTwoParts) {
  const std::string nodes = R"([{"children": [1, 2]}, {"mesh": 0, "name": "left"},
    {"mesh": 0, "translation": [0.05, 0, 0]}])";
  const PolygonSoup soup = read_mesh("box.gltf", document(nodes, inside()));
  EXPECT_EQ(soup.group_names, (std::vector<std::string>{"left", "node 2"}));
  EXPECT_EQ(convex_parts(soup).size(), 2U);
}

TEST(MeshGltf, ABinaryFileIsTheSame) {
  std::string text = document(R"([{"mesh": 0}])", "");
  while (text.size() % 4 != 0) text += ' ';
  const std::string data = box_buffer();
  std::string bytes;
  append(bytes, 0x46546C67);
  append(bytes, 2);
  append(bytes, static_cast<std::uint32_t>(28 + text.size() + data.size()));
  append(bytes, static_cast<std::uint32_t>(text.size()));
  append(bytes, 0x4E4F534A);
  bytes += text;
  append(bytes, static_cast<std::uint32_t>(data.size()));
  append(bytes, 0x004E4942);
  bytes += data;
  expect_box(read_mesh("box.glb", bytes), Vec3(0.02, 0.06, 0.04), Vec3(0));
  for (std::size_t cut = 0; cut < bytes.size(); cut += 7)
    EXPECT_THROW(read_mesh("box.glb", bytes.substr(0, cut)), MeshError) << cut;
}

TEST(MeshGltf, BuffersBesideTheFileAreTakenIn) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "palpate_mesh_gltf_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "box.bin", std::ios::binary) << box_buffer();
  std::ofstream(folder / "box.gltf") << document(R"([{"mesh": 0}])", "box.bin");
  const std::string path = (folder / "box.gltf").string();
  const std::string bytes = mesh_file_bytes(path);
  std::filesystem::remove(folder / "box.bin");
  expect_box(read_mesh(path, bytes), Vec3(0.02, 0.06, 0.04), Vec3(0));
  try {
    mesh_file_bytes(path);
    FAIL() << "its buffer is gone";
  } catch (const MeshError& error) {
    EXPECT_NE(std::string(error.what()).find("box.bin"), std::string::npos) << error.what();
  }
  std::filesystem::remove_all(folder);
}

std::string refusal(const std::string& text) {
  try {
    read_mesh("a.gltf", text);
    return "taken";
  } catch (const MeshError& error) {
    return error.what();
  }
}

TEST(MeshGltf, FaultsNameTheirPlace) {
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = document(R"([{"mesh": 0}])", inside());
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return refusal(text.replace(at, from.size(), to));
  };
  const std::pair<std::string, std::string> good{"\"count\": 8", "\"count\": 8"};
  EXPECT_EQ(changed(good.first, good.second), "taken");
  EXPECT_EQ(
      changed("\"count\": 8", "\"count\": 9").rfind("a.gltf: /bufferViews/0: expected room", 0),
      0U);
  EXPECT_EQ(changed("5123", "5120"),
            "a.gltf: /accessors/1: expected unsigned indices (5121, 5123, 5125), found 5120");
  EXPECT_EQ(changed("\"indices\": 1", "\"indices\": 1, \"mode\": 5"),
            "a.gltf: /meshes/0/primitives/0: expected triangles (mode 4), found 5");
  EXPECT_EQ(changed("[{\"mesh\": 0}]", "[{\"children\": [0]}]")
                .rfind("a.gltf: /nodes/0: expected nodes within at most 100", 0),
            0U);
  for (const auto& [from, to] :
       {std::pair("\"2.0\"", "\"1.0\""),
        {"\"VEC3\"", "\"VEC4\""},
        {"\"POSITION\": 0", "\"POSITION\": 7"},
        {"\"POSITION\": 0", "\"POSITION\": \"x\""},
        {"\"buffer\": 0", "\"buffer\": -1"},
        {"[{\"mesh\": 0}]", "[{\"mesh\": 4}]"},
        {"\"nodes\": [0]", "\"nodes\": [3]"},
        {"\"count\": 36", "\"count\": 35"},
        {"base64,", "base64,%"},
        {"{\"asset\"", "{asset"},
        {"\"scene\": 0", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]"}}) {
    EXPECT_EQ(changed(from, to).rfind("a.gltf: ", 0), 0U) << from << " -> " << to;
  }
}

TEST(Base64, IsItsOwnInverse) {
  // RFC 4648, section 10.
  EXPECT_EQ(base64_encoded(""), "");
  EXPECT_EQ(base64_encoded("f"), "Zg==");
  EXPECT_EQ(base64_encoded("fo"), "Zm8=");
  EXPECT_EQ(base64_encoded("foo"), "Zm9v");
  EXPECT_EQ(base64_encoded("foobar"), "Zm9vYmFy");
  std::string bytes;
  for (int i = 0; i < 256; ++i) {
    bytes += static_cast<char>(i);
    EXPECT_EQ(base64_decoded(base64_encoded(bytes)), bytes);
  }
  EXPECT_EQ(base64_decoded("Zg"), "f");
  EXPECT_FALSE(base64_decoded("Z"));
  EXPECT_FALSE(base64_decoded("Zm9v!"));
}

}  // namespace
}  // namespace palpate::stimuli
