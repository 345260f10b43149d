#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_file.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/temporary_folder.h"
#include "tests/stimuli/gltf_box.h"

namespace palpate::stimuli {
namespace {

using gltf::changed;
using gltf::document;

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

const Vec3 kSize(0.02, 0.06, 0.04);  // of the box, up turned from y to z

TEST(MeshGltf, UpIsTurnedFromYToZ) {
  expect_box(read_mesh("box.gltf", document()), kSize, Vec3(0));
}

TEST(MeshGltf, TransformsOfNodesWithinNodesApply) {
  // Scaled, turned by 90 degrees about y, moved; then the outer node moves and mirrors it.
  const std::string nodes = R"([{"children": [1], "scale": [-1, 1, 1], "translation": [0, 0.5, 0]},
    {"mesh": 0, "scale": [2, 1, 1], "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476],
     "translation": [0.1, 0, 0.3]}])";
  // x: 2 * 0.02 becomes z, z becomes x; then (x, y, z) = (-0.1, 0.5, 0.3), in our frame (x, -z, y).
  expect_box(read_mesh("box.gltf", document(nodes)), Vec3(0.06, 0.04, 0.04), Vec3(-0.1, -0.3, 0.5));
  const std::string matrix =
      R"([{"mesh": 0, "matrix": [0,0,-2,0, 0,1,0,0, 1,0,0,0, 0.1,0.2,0.3,1]}])";
  expect_box(read_mesh("box.gltf", document(matrix)), Vec3(0.06, 0.04, 0.04), Vec3(0.1, -0.3, 0.2));
}

TEST(MeshGltf, RotationIsCounterClockwiseAgainstItsAxis) {
  const auto centre = [](const std::string& rotation) {
    const std::string nodes = R"([{"children": [1], "rotation": )" + rotation +
                              R"(}, {"mesh": 0, "translation": [0.1, 0.2, 0.4]}])";
    return convex_parts(read_mesh("box.gltf", document(nodes))).at(0).centre();
  };
  // By 90 degrees about y, z goes to x and x to -z; about x, y to z; about z, x to y.
  const std::string half = "0.7071067811865476";
  EXPECT_LT(glm::length(centre("[0," + half + ",0," + half + "]") - Vec3(0.4, 0.1, 0.2)), 1e-8);
  EXPECT_LT(glm::length(centre("[" + half + ",0,0," + half + "]") - Vec3(0.1, -0.2, -0.4)), 1e-8);
  EXPECT_LT(glm::length(centre("[0,0," + half + "," + half + "]") - Vec3(-0.2, -0.4, 0.1)), 1e-8);
}

TEST(MeshGltf, ARoundedQuaternionNeitherScalesNorShears) {
  const std::string nodes = R"([{"mesh": 0, "rotation": [0, 0.7076, 0, 0.7076]}])";  // 1.0007 long
  expect_box(read_mesh("box.gltf", document(nodes)), Vec3(0.06, 0.02, 0.04), Vec3(0));
}

TEST(MeshGltf, MirroredNodesAreNotInsideOut) {
  for (const char* scale : {"[-1, 1, 1]", "[1, -1, 1]", "[-1, -1, -1]", "[-1, -1, 1]"}) {
    const std::string nodes = std::string(R"([{"mesh": 0, "scale": )") + scale + "}]";
    expect_box(read_mesh("box.gltf", document(nodes)), kSize, Vec3(0));
  }
}

TEST(MeshGltf, AMeshUsedTwiceIsTwoParts) {
  const std::string nodes = R"([{"children": [1, 2]}, {"mesh": 0, "name": "left"},
    {"mesh": 0, "translation": [0.05, 0, 0]}])";
  const PolygonSoup soup = read_mesh("box.gltf", document(nodes));
  EXPECT_EQ(soup.group_names, (std::vector<std::string>{"left", "node 2"}));
  EXPECT_EQ(convex_parts(soup).size(), 2U);
}

TEST(MeshGltf, TheDefaultSceneIsRead) {
  const std::string nodes = R"([{"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0]}])";
  const std::string text = changed(document(nodes), "[{\"nodes\": [0]}]",
                                   "[{\"nodes\": [0]}, {\"nodes\": [1]}, {\"nodes\": [0, 1]}]");
  expect_box(read_mesh("a.gltf", text), kSize, Vec3(0));
  expect_box(read_mesh("a.gltf", changed(text, "\"scene\": 0", "\"scene\": 1")), kSize,
             Vec3(1, 0, 0));
  // Without a scene: the nodes that are no other's children.
  const std::string roots = R"([{"mesh": 0}, {"children": [0], "translation": [1, 0, 0]}])";
  expect_box(read_mesh("a.gltf", changed(document(roots), "\"scenes\"", "\"extras\"")), kSize,
             Vec3(1, 0, 0));
}

TEST(MeshGltf, EveryWidthOfIndicesIsRead) {
  for (const auto& [type, size] : {std::pair("5121", 1), {"5123", 2}, {"5125", 4}}) {
    const std::string data = gltf::box_corners() + gltf::box_indices(size);
    std::string text = document(R"([{"mesh": 0}])", gltf::data_uri(data));
    text = changed(text, "5123", type);
    text = changed(text, "\"byteLength\": 72", "\"byteLength\": " + std::to_string(36 * size));
    text = changed(text, "\"byteLength\": 168", "\"byteLength\": " + std::to_string(data.size()));
    expect_box(read_mesh("a.gltf", text), kSize, Vec3(0));
  }
}

TEST(MeshGltf, InterleavedPositionsAreRead) {
  const std::string data = std::string(4, '\x7f') + gltf::box_corners(20) + gltf::box_indices();
  std::string text = document(R"([{"mesh": 0}])", gltf::data_uri(data));
  text = changed(text, "\"byteLength\": 96", "\"byteLength\": 260, \"byteStride\": 32");
  text = changed(text, "{\"bufferView\": 0", "{\"byteOffset\": 4, \"bufferView\": 0");
  text = changed(text, "\"byteOffset\": 96", "\"byteOffset\": 260");
  expect_box(read_mesh("a.gltf", text), kSize, Vec3(0));
}

TEST(MeshGltf, StripsAndFansAreTriangles) {
  const auto with = [](const std::vector<std::uint32_t>& corners, const std::string& primitives,
                       const std::string& accessors) {
    std::string data = gltf::box_corners();
    for (const std::uint32_t corner : corners) gltf::append(data, corner, 2);
    std::string text = document(R"([{"mesh": 0}])", gltf::data_uri(data));
    text = changed(text, R"({"attributes": {"POSITION": 0}, "indices": 1})", primitives);
    text =
        changed(text, R"({"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"})",
                accessors);
    text =
        changed(text, "\"byteLength\": 72", "\"byteLength\": " + std::to_string(data.size() - 96));
    return changed(text, "\"byteLength\": 168", "\"byteLength\": " + std::to_string(data.size()));
  };
  const std::string seen = R"({"attributes": {"POSITION": 0}, "mode": )";
  const std::string read =
      R"({"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": )";
  // A strip over all sides.
  expect_box(read_mesh("a.gltf", with({0, 1, 4, 5, 7, 1, 3, 0, 2, 4, 6, 7, 2, 3},
                                      seen + R"(5, "indices": 1})", read + "14}")),
             kSize, Vec3(0));
  // The three sides round a corner, and those round the opposite one.
  expect_box(read_mesh("a.gltf", with({0, 4, 6, 2, 3, 1, 5, 4, 7, 6, 4, 5, 1, 3, 2, 6},
                                      seen + R"(6, "indices": 1}, )" + seen + R"(6, "indices": 2})",
                                      read + "8}, " + read + R"(8, "byteOffset": 16})")),
             kSize, Vec3(0));
}

/// The box with corners as integers of two bytes, and its node's scale.
std::string quantized(int component, bool normalised, int most, const std::string& scale) {
  std::string data;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const bool low = (corner >> axis & 1U) == 0;
      const int least = component == 5122 ? -most : 0;
      gltf::append(data, static_cast<std::uint32_t>(low ? least : most), 2);
    }
    gltf::append(data, 0, 2);  // to a multiple of four bytes
  }
  data += gltf::box_indices();
  std::string text = document(R"([{"mesh": 0, "scale": )" + scale + "}]", gltf::data_uri(data));
  text = changed(text, "5126",
                 std::to_string(component) + (normalised ? ", \"normalized\": true" : ""));
  text = changed(text, "\"scene\": 0", R"("extensionsRequired": ["KHR_mesh_quantization"])");
  text = changed(text, "\"byteLength\": 96", R"("byteLength": 64, "byteStride": 8)");
  text = changed(text, "\"byteOffset\": 96", "\"byteOffset\": 64");
  return changed(text, "\"byteLength\": 168", "\"byteLength\": 136");
}

TEST(MeshGltf, ReadsQuantizedPositions) {
  const Vec3 corner(kSize.x, -kSize.y, kSize.z);
  expect_box(read_mesh("a.gltf", quantized(5122, true, 32767, "[0.01, 0.02, 0.03]")), kSize,
             Vec3(0));
  expect_box(read_mesh("a.gltf", quantized(5122, false, 1000, "[1e-5, 2e-5, 3e-5]")), kSize,
             Vec3(0));
  expect_box(read_mesh("a.gltf", quantized(5123, true, 65535, "[0.02, 0.04, 0.06]")), kSize,
             corner / 2.0);
  expect_box(read_mesh("a.gltf", quantized(5123, false, 40000, "[5e-7, 1e-6, 1.5e-6]")), kSize,
             corner / 2.0);
}

TEST(MeshGltf, NormalisedIntegersEndAtMinusOne) {
  const PolygonSoup soup =
      read_mesh("a.gltf", quantized(5122, true, 32768, "[1, 1, 1]"));  // -32768, 32768 wraps
  for (const Vec3& vertex : soup.vertices) EXPECT_EQ(glm::abs(vertex), Vec3(1));
}

/// The box, whose first corners are wrong but for the values of a sparse accessor.
std::string sparse(bool has_view) {
  const std::string right = gltf::box_corners();
  const std::size_t kept = has_view ? 4 : 0;  // corners of the bufferView
  std::string data = std::string(96 - 12 * kept, '\0') + right.substr(96 - 12 * kept);
  data += gltf::box_indices();
  for (std::uint32_t corner = 0; corner < 8 - kept; ++corner) gltf::append(data, corner, 1);
  data += right.substr(0, 96 - 12 * kept);
  const std::size_t places = 168, values = places + 8 - kept;
  std::string text = document(R"([{"mesh": 0}])", gltf::data_uri(data));
  const std::string views = R"(, {"buffer": 0, "byteOffset": 168, "byteLength": )" +
                            std::to_string(8 - kept) + R"(}, {"buffer": 0, "byteOffset": )" +
                            std::to_string(values) + R"(, "byteLength": )" +
                            std::to_string(96 - 12 * kept) + "}]";
  text = changed(text, "\"byteLength\": 72}]", "\"byteLength\": 72}" + views);
  text = changed(text, has_view ? "\"type\": \"VEC3\"" : "{\"bufferView\": 0,",
                 std::string(has_view ? "" : "{") + R"("sparse": {"count": )" +
                     std::to_string(8 - kept) +
                     R"(, "indices": {"bufferView": 2, "componentType": 5121},
                        "values": {"bufferView": 3}}, )" +
                     (has_view ? "\"type\": \"VEC3\"" : ""));
  return changed(text, "\"byteLength\": 168", "\"byteLength\": " + std::to_string(data.size()));
}

TEST(MeshGltf, ReadsSparsePositions) {
  expect_box(read_mesh("a.gltf", sparse(true)), kSize, Vec3(0));
  expect_box(read_mesh("a.gltf", sparse(false)), kSize, Vec3(0));
}

TEST(MeshGltf, PassesOverExtensionsOfLooks) {
  const std::string looks =
      R"("extensionsRequired": ["KHR_materials_unlit", "KHR_texture_transform"])";
  expect_box(read_mesh("a.gltf", changed(document(), "\"scene\": 0", looks)), kSize, Vec3(0));
}

TEST(MeshGltf, ABinaryFileIsTheSame) {
  const std::string bytes = gltf::binary_file(document(R"([{"mesh": 0}])", ""), gltf::box_buffer());
  expect_box(read_mesh("box.glb", bytes), kSize, Vec3(0));
  for (std::size_t cut = 0; cut < bytes.size(); cut += 7)
    EXPECT_THROW(read_mesh("box.glb", bytes.substr(0, cut)), MeshError) << cut;
}

class MeshGltfBuffers : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_ / "inner" / "data");
    path_ = (folder_ / "inner" / "box.gltf").string();
  }

  void write_buffer(const std::string& name) const {
    std::ofstream(folder_ / "inner" / name, std::ios::binary) << gltf::box_buffer();
  }
  MeshFileBytes bytes_with(const std::string& uri) const {
    std::ofstream(path_) << document(R"([{"mesh": 0}])", uri);
    return mesh_file_bytes(path_);
  }
  std::string refusal_of(const std::string& uri) const {
    try {
      bytes_with(uri);
      return "taken";
    } catch (const MeshError& error) {
      return error.what();
    }
  }

  const testing::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
  std::string path_;
};

TEST_F(MeshGltfBuffers, BesideTheFileAreTakenInAndNamed) {
  for (const auto& [name, uri] : {std::pair("box.bin", "box.bin"),
                                  {"my mesh.bin", "my%20mesh.bin"},
                                  {"my mesh.bin", "my mesh.bin"},
                                  {"data/h\xC3\xA4lfte.bin", "data/h%C3%a4lfte.bin"},
                                  {"100%.bin", "100%25.bin"},
                                  {"%2e.bin", "%252e.bin"}}) {
    write_buffer(name);
    const MeshFileBytes read = bytes_with(uri);
    const std::string buffer = (folder_ / "inner" / name).string();
    EXPECT_EQ(read.files, (std::vector<std::string>{path_, buffer}));
    std::filesystem::remove(buffer);
    expect_box(read_mesh(path_, read.bytes), kSize, Vec3(0));
  }
}

TEST_F(MeshGltfBuffers, ThatAreMissingAreNamed) {
  const std::string text = refusal_of("box.bin");
  EXPECT_EQ(text.rfind(path_ + ": /buffers/0/uri: ", 0), 0U) << text;
  EXPECT_NE(text.find("inner/box.bin: expected a file, found No such file"), std::string::npos)
      << text;
}

TEST_F(MeshGltfBuffers, ElsewhereAreRefusedHoweverTheyAreWritten) {
  write_buffer("../box.bin");
  const std::string outside = (folder_ / "box.bin").string();
  for (const std::string& uri :
       {std::string("../box.bin"), std::string("%2e%2e/box.bin"), std::string("%2E./box.bin"),
        std::string("..%2fbox.bin"), std::string("data/%2e%2e/%2e%2e/box.bin"), outside,
        "%2f" + outside.substr(1), "file://" + outside, std::string("https://a.org/box.bin")}) {
    EXPECT_EQ(refusal_of(uri).rfind(
                  path_ + ": /buffers/0/uri: expected a file in the same folder or one within", 0),
              0U)
        << uri << ": " << refusal_of(uri);
  }
  for (const std::string uri : {"box%2", "box%zz.bin", "box%00.bin", "%"})
    EXPECT_NE(refusal_of(uri).find("hexadecimal"), std::string::npos) << uri;
  EXPECT_NE(refusal_of("data").find("expected a file"), std::string::npos) << refusal_of("data");
}

}  // namespace
}  // namespace palpate::stimuli
