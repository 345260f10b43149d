#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "data/base/base64.h"
#include "data/base/random.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_file.h"
#include "stimuli/mesh_formats.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "tests/stimuli/gltf_box.h"

namespace palpate::stimuli {
namespace {

using gltf::document;

std::string refusal_of(const std::string& text) {
  try {
    read_mesh("a.gltf", text);
    return "taken";
  } catch (const MeshError& error) {
    return error.what();
  }
}

std::string refusal_with(const std::string& from, const std::string& to) {
  const std::string text = gltf::changed(document(), from, to);
  EXPECT_NE(text, "") << from;
  return refusal_of(text);
}

TEST(MeshGltfFaults, NameThePlaceAndWhatWasExpected) {
  EXPECT_EQ(refusal_with("\"count\": 8", "\"count\": 8"), "taken");
  const auto expect = [](const std::string& from, const std::string& to, const std::string& fault) {
    EXPECT_EQ(refusal_with(from, to), "a.gltf: " + fault) << from << " -> " << to;
  };
  expect("\"2.0\"", "\"1.0\"", "/asset/version: expected \"2.0\", found \"1.0\"");
  expect("\"asset\"", "\"assets\"",
         "/asset: expected an object with the version of glTF, found nothing");
  expect("\"scene\": 0", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]",
         "/extensionsRequired/0: expected a file without compression (npx @gltf-transform/cli copy "
         "COMPRESSED.glb PLAIN.glb), found \"KHR_draco_mesh_compression\"");
  expect("\"scene\": 0", "\"extensionsRequired\": [\"KHR_materials_unlit\", \"ADOBE_other\"]",
         "/extensionsRequired/1: expected a file that needs no extension but KHR_mesh_quantization "
         "and those of looks, found \"ADOBE_other\"");
  expect("\"scene\": 0", "\"scene\": 1",
         "/scene: expected the number of a scene from 0 to 0, found 1");
  expect("\"nodes\": [0]", "\"nodes\": [3]",
         "/scenes/0/nodes/0: expected the number of a node from 0 to 0, found 3");
  expect("\"nodes\": [0]", "\"nodes\": 0", "/scenes/0/nodes: expected a list, found 0");
  for (const auto& [mesh, found] : {std::pair("-1", "-1"),
                                    {"4", "4"},
                                    {"0.5", "0.5"},
                                    {"1e300", "1e+300"},
                                    {"\"0\"", "\"0\""},
                                    {"null", "null"},
                                    {"[0]", "a list of 1"}}) {
    expect("[{\"mesh\": 0}]", std::string("[{\"mesh\": ") + mesh + "}]",
           std::string("/nodes/0/mesh: expected the number of a mesh from 0 to 0, found ") + found);
  }
  expect("\"POSITION\": 0", "\"POSITION\": 7",
         "/meshes/0/primitives/0/attributes/POSITION: expected the number of an accessor from 0 to "
         "1, found 7");
  expect("\"POSITION\": 0", "\"NORMAL\": 0",
         "/meshes/0/primitives/0/attributes/POSITION: expected the number of an accessor from 0 to "
         "1, found nothing");
  expect("\"VEC3\"", "\"VEC4\"", "/accessors/0/type: expected \"VEC3\", found \"VEC4\"");
  expect("5126", "5123",
         "/accessors/0/componentType: expected 5126 (positions in single precision), or "
         "KHR_mesh_quantization in extensionsRequired, found 5123");
  expect("5126", "5125",
         "/accessors/0/componentType: expected 5126 (positions in single precision), found 5125");
  expect("5123", "5120",
         "/accessors/1/componentType: expected 5121, 5123 or 5125 (unsigned indices), found 5120");
  expect("\"bufferView\": 0,", "\"bufferView\": 0, \"sparse\": {},",
         "/accessors/0/sparse/count: expected a number of values, found nothing");
  expect("\"bufferView\": 0,", "\"bufferView\": 0, \"sparse\": {\"count\": 9},",
         "/accessors/0/sparse/count: expected 1 to 8 values, found 9");
  expect("\"bufferView\": 0,",
         R"("bufferView": 0, "sparse": {"count": 4, "indices": {"bufferView": 1,
            "componentType": 5123}, "values": {"bufferView": 0}},)",
         "/accessors/0/sparse/indices: expected rising numbers of values below 8, found 0 as "
         "number 3");
  expect("\"count\": 36", "\"count\": 1e12",
         "/accessors/1/count: expected at most 393216 values, for a file of this size, found "
         "1000000000000.0");
  expect("\"bufferView\": 0,", "",
         "/accessors/0/bufferView: expected the number of a bufferView from 0 to 1, found nothing");
  expect("\"count\": 8", "\"count\": 9",
         "/accessors/0: expected room for 9 values of 12 bytes in its bufferView, found 96 bytes");
  expect("\"count\": 8", "\"count\": 7",
         "/accessors/1: expected numbers of vertices from 0 to 6, found 7 as number 8");
  expect("\"count\": 36", "\"count\": 35",
         "/meshes/0/primitives/0: expected three corners for each triangle, found 35");
  expect("\"byteLength\": 72", "\"byteLength\": 73",
         "/bufferViews/1: expected at most the 168 bytes of its buffer, found 73 bytes from byte "
         "96");
  expect("\"byteLength\": 96", "\"byteLength\": 96, \"byteStride\": 8",
         "/bufferViews/0/byteStride: expected 12 to 252 bytes from one value to the next, found 8");
  expect("\"buffer\": 0", "\"buffer\": -1",
         "/bufferViews/0/buffer: expected the number of a buffer from 0 to 0, found -1");
  expect("\"byteLength\": 168", "\"byteLength\": 169",
         "/buffers/0/byteLength: expected 169 bytes of data, found 168");
  expect("\"indices\": 1", "\"indices\": 1, \"mode\": 1",
         "/meshes/0/primitives/0/mode: expected 4, 5 or 6 (triangles), found 1");
  expect("\"primitives\"", "\"weights\": [0, 0.5], \"primitives\"",
         "/meshes/0/weights/1: expected 0 (export without morph targets), found 0.5");
  expect("\"mesh\": 0", "\"name\": 5, \"mesh\": 0", "/nodes/0/name: expected a name, found 5");
  EXPECT_EQ(refusal_with("base64,", "base64,%")
                .rfind("a.gltf: /buffers/0/uri: expected data in base64, found \"data:", 0),
            0U);
}

TEST(MeshGltfFaults, BrokenJsonIsNamedByItsLine) {
  EXPECT_EQ(refusal_of("{\"asset\": {\n  \"version\" \"2.0\"}}")
                .rfind("a.gltf: line 2: expected JSON (glTF 2.0), found \"", 0),
            0U);
  EXPECT_EQ(refusal_of(""), "a.gltf: line 1: expected JSON (glTF 2.0), found the end of the text");
  EXPECT_EQ(refusal_of("[]"), "a.gltf: expected a JSON object, found a list of 0");
  EXPECT_EQ(refusal_of("{}"),
            "a.gltf: /asset: expected an object with the version of glTF, found nothing");
}

TEST(MeshGltfFaults, NodesAreStrictTrees) {
  const auto of_nodes = [](const std::string& nodes) { return refusal_of(document(nodes)); };
  const std::string one_parent =
      ": expected a node with at most one parent, once in the scene, found ";
  EXPECT_EQ(of_nodes("[{\"children\": [0]}]"), "a.gltf: /nodes/0/children/0" + one_parent + "0");
  EXPECT_EQ(of_nodes("[{\"children\": [1, 1]}, {\"mesh\": 0}]"),
            "a.gltf: /nodes/0/children/1" + one_parent + "1");
  EXPECT_EQ(refusal_with("\"nodes\": [0]", "\"nodes\": [0, 0]"),
            "a.gltf: /scenes/0/nodes/1" + one_parent + "0");
  // The number of paths doubles at each of 60 levels: visiting them all would never end.
  std::string nodes = "[", chain = "[";
  for (int i = 1; i <= 60; ++i) {
    const std::string next = std::to_string(i);
    nodes += "{\"children\": [" + next + ", " + next + "]}, ";
  }
  EXPECT_NE(of_nodes(nodes + "{\"mesh\": 0}]").find(one_parent), std::string::npos);
  for (int i = 1; i <= 101; ++i) chain += "{\"children\": [" + std::to_string(i) + "]}, ";
  EXPECT_EQ(of_nodes(chain + "{\"mesh\": 0}]"),
            "a.gltf: /nodes/101: expected nodes within at most 100 others, found a deeper one");
}

TEST(MeshGltfFaults, MemoryIsInProportionToTheFile) {
  constexpr int kVertices = 999, kPrimitives = 3000;
  const std::string data(kVertices * 12, '\0');
  std::string primitives;
  for (int i = 0; i < kPrimitives; ++i)
    primitives += std::string(i > 0 ? "," : "") + R"({"attributes": {"POSITION": 0}})";
  const auto of = [&](const std::string& asset) {
    return R"({"asset": {"version": "2.0")" + asset + R"(}, "meshes": [{"primitives": [)" +
           primitives + R"(]}],
   "accessors": [{"bufferView": 0, "componentType": 5126, "count": 999, "type": "VEC3"}],
   "bufferViews": [{"buffer": 0, "byteLength": 11988}],
   "buffers": [{"byteLength": 11988, "uri": ")" +
           gltf::data_uri(data) + R"("}]})";
  };
  // 2^17 are always read.
  EXPECT_EQ(refusal_of(of("")),
            "a.gltf: /meshes/0/primitives/131: expected at most 131072 vertices in all nodes, for "
            "a file of this size, found more");
  const std::string larger = of(R"(, "note": ")" + std::string(200'000, 'x') + "\"");
  EXPECT_EQ(refusal_of(larger), "a.gltf: /meshes/0/primitives/" +
                                    std::to_string(larger.size() / kVertices) +
                                    ": expected at most " + std::to_string(larger.size()) +
                                    " vertices in all nodes, for a file of this size, found more");
  // A strip of n + 2 corners is n triangles.
  std::string strips;
  for (int i = 0; i < kPrimitives; ++i)
    strips += std::string(i > 0 ? "," : "") +
              R"({"attributes": {"POSITION": 0}, "indices": 1, "mode": 5})";
  const std::string corners(1002, '\0'), points(36, '\0');
  const std::string text = R"({"asset": {"version": "2.0"}, "meshes": [{"primitives": [)" + strips +
                           R"(]}],
   "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                 {"bufferView": 1, "componentType": 5121, "count": 1002, "type": "SCALAR"}],
   "bufferViews": [{"buffer": 0, "byteLength": 36},
                   {"buffer": 0, "byteOffset": 36, "byteLength": 1002}],
   "buffers": [{"byteLength": 1038, "uri": ")" +
                           gltf::data_uri(points + corners) + R"("}]})";
  EXPECT_EQ(refusal_of(text), "a.gltf: /meshes/0/primitives/" + std::to_string(text.size() / 1000) +
                                  ": expected at most " + std::to_string(text.size()) +
                                  " triangles in all nodes, for a file of this size, found more");
  const auto named = [](std::size_t length) {
    return refusal_of(document("[{\"mesh\": 0, \"name\": \"" + std::string(length, 'x') + "\"}]"));
  };
  EXPECT_EQ(named(256), "taken");
  EXPECT_NE(named(257).find("/nodes/0/name: expected a name of at most 256 bytes"),
            std::string::npos);
}

TEST(MeshGltfFaults, DeepJsonIsRefused) {
  const auto nested = [](const std::string& member, int depth) {
    return document(R"([{"mesh": 0, ")" + member +
                    "\": " + std::string(static_cast<std::size_t>(depth), '[') +
                    std::string(static_cast<std::size_t>(depth), ']') + "}]");
  };
  EXPECT_EQ(refusal_of(nested("extras", 61)), "taken");  // and three around them
  const std::string too_deep =
      "a.gltf: expected objects and arrays at most 64 deep within each other, found deeper ones";
  EXPECT_EQ(refusal_of(nested("extras", 62)), too_deep);
  EXPECT_EQ(refusal_of(nested("extras", 100'000)), too_deep);
  const std::string named =
      gltf::changed(nested("extras", 100'000), R"("uri": "data:)", R"("uri": "a.bin", "x": ")");
  EXPECT_EQ(with_buffers(named, [](const auto&, const auto&) { return std::string(); }), named);
}

TEST(MeshGltfFaults, TransformsAreRotationsAndNumbers) {
  const auto of_node = [](const std::string& member) {
    return refusal_of(document("[{\"mesh\": 0, " + member + "}]"));
  };
  EXPECT_EQ(of_node("\"rotation\": [0, 0, 1, 1]"),
            "a.gltf: /nodes/0/rotation: expected a unit quaternion [x, y, z, w] (within 0.001), "
            "found one of length 1.41421");
  EXPECT_NE(of_node("\"rotation\": [0, 0, 0, 0]"), "taken");
  EXPECT_NE(of_node("\"rotation\": [0, 0, 0, 1.0011]"), "taken");
  EXPECT_EQ(of_node("\"rotation\": [0, 0, 0, 0.9991]"), "taken");
  EXPECT_EQ(of_node("\"rotation\": [0, 0, 1]"),
            "a.gltf: /nodes/0/rotation: expected a list of 4 numbers, found a list of 3");
  EXPECT_EQ(of_node("\"scale\": 2"),
            "a.gltf: /nodes/0/scale: expected a list of 3 numbers, found 2");
  EXPECT_EQ(of_node("\"translation\": [0, \"1\", 0]"),
            "a.gltf: /nodes/0/translation/1: expected a number, found \"1\"");
  EXPECT_EQ(of_node("\"matrix\": [1,0,0,0.5, 0,1,0,0, 0,0,1,0, 0,0,0,1]"),
            "a.gltf: /nodes/0/matrix/3: expected 0 (no perspective), found 0.5");
  EXPECT_EQ(of_node("\"scale\": [1, 0, 1]"),
            "a.gltf: /nodes/0: expected a mesh that is placed as a solid, found a scale of 0");
  const std::string huge = "\"scale\": [1e200, 1e200, 1e200]";
  EXPECT_EQ(
      refusal_of(document("[{\"children\": [1], " + huge + "}, {\"mesh\": 0, " + huge + "}]")),
      "a.gltf: /meshes/0/primitives/0: expected finite coordinates where its node places it, "
      "found others");
}

TEST(MeshGltfFaults, LengthsInABinaryFileAreChecked) {
  const std::string text = document(R"([{"mesh": 0}])", "");
  const std::string good = gltf::binary_file(text, gltf::box_buffer());
  const auto with = [&](std::size_t at, std::uint32_t word) {
    std::string bytes = good, number;
    gltf::append(number, word);
    return refusal_of(bytes.replace(at, 4, number));
  };
  const std::string size = std::to_string(good.size());
  EXPECT_EQ(refusal_of(good), "taken");
  EXPECT_EQ(with(8, 7), "a.gltf: byte 8: expected a file of 7 bytes, found " + size + " bytes");
  EXPECT_EQ(with(4, 1), "a.gltf: byte 4: expected glTF version 2, found 1");
  EXPECT_EQ(with(12, 0xffffffff), "a.gltf: byte 12: expected a chunk of 4294967295 bytes, found " +
                                      std::to_string(good.size() - 20) + " bytes");
  EXPECT_EQ(with(16, 0x004E4942),
            "a.gltf: byte 16: expected the chunk of JSON first, found another");
  EXPECT_EQ(refusal_of(good + "x"), "a.gltf: byte 8: expected a file of " + size +
                                        " bytes, found " + std::to_string(good.size() + 1) +
                                        " bytes");
  EXPECT_EQ(refusal_of("glTF"),
            "a.gltf: byte 0: expected the headers of a .glb, 20 bytes, found 4 bytes");
  EXPECT_NE(refusal_of(gltf::binary_file(gltf::document(R"([{"mesh": 0}])", "box.bin"),
                                         gltf::box_buffer()))
                .find("/buffers/0/uri: expected data in base64"),
            std::string::npos);
}

TEST(MeshGltfFaults, SurfacesAreNamedByPrimitiveAndNode) {
  const std::string text =
      gltf::changed(document(R"([{"mesh": 0, "name": "left"}])"), "\"count\": 36", "\"count\": 33");
  try {
    convex_parts(read_mesh("a.gltf", text));
    ADD_FAILURE() << "it is open";
  } catch (const MeshError& error) {
    // The last of the twelve triangles is missing: 4, 7, 6, with open edges 6-7 and 4-6.
    EXPECT_NE(
        std::string(error.what())
            .find("open: edge 6-7 of face 6 of /meshes/0/primitives/0 in 'left' (vertices 2 6 7)"),
        std::string::npos)
        << error.what();
  }
}

// Damaged files give only a soup or a MeshError.
TEST(MeshGltfFaults, DamagedFilesNeverCrash) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  const std::string files[] = {
      document(), gltf::binary_file(document(R"([{"mesh": 0}])", ""), gltf::box_buffer())};
  int taken = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string bytes = files[random.below(2)];
    for (std::uint64_t damage = 1 + random.below(3); damage > 0; --damage) {
      const std::size_t at = random.below(bytes.size());
      if (random.below(2) == 0) {
        // Changing a digit or sign keeps the document valid.
        const std::size_t digit = bytes.find_first_of("0123456789", at);
        if (digit != std::string::npos) bytes[digit] = "0123456789-.e"[random.below(13)];
      } else {
        bytes.replace(at, random.below(4),
                      bytes.substr(random.below(bytes.size()), random.below(4)));
      }
    }
    try {
      convex_parts(read_mesh("a.gltf", bytes));
      ++taken;
    } catch (const MeshError& error) {
      EXPECT_FALSE(error.faults().empty());
      EXPECT_EQ(std::string(error.what()).find("json.exception"), std::string::npos);
    }
  }
  EXPECT_GT(taken, 0);
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
