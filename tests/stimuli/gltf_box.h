#pragma once
// A box as a glTF file, put together from the specification.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include "data/base/base64.h"

namespace palpate::stimuli::gltf {

inline void append(std::string& bytes, std::uint32_t word, int size = 4) {
  for (int b = 0; b < size; ++b) bytes += static_cast<char>(word >> (8 * b) & 255U);
}

// A box of 0.02 x 0.04 x 0.06 m, as a file would hold it: x, y up, z towards the viewer.
inline constexpr float kHalf[3] = {0.01F, 0.02F, 0.03F};
inline constexpr int kTriangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                          {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                          {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};

/// Corner k has the sign of axis a in its bit a. \param gap  bytes after each corner
inline std::string box_corners(int gap = 0) {
  std::string bytes;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      const float value = (corner >> axis & 1) != 0 ? kHalf[axis] : -kHalf[axis];
      append(bytes, std::bit_cast<std::uint32_t>(value));
    }
    bytes += std::string(static_cast<std::size_t>(gap), '\x7f');
  }
  return bytes;
}

inline std::string box_indices(int size = 2) {
  std::string bytes;
  for (const auto& triangle : kTriangles) {
    for (const int corner : triangle) append(bytes, static_cast<std::uint32_t>(corner), size);
  }
  return bytes;
}

inline std::string box_buffer() { return box_corners() + box_indices(); }

inline std::string data_uri(const std::string& bytes) {
  return "data:application/octet-stream;base64," + base64_encoded(bytes);
}

/// A document over the box's buffer. \param uri  of the buffer; empty: none
inline std::string document(const std::string& nodes, const std::string& uri) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": )" +
         nodes + R"(, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
   "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
                 {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
   "bufferViews": [{"buffer": 0, "byteLength": 96},
                   {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
   "buffers": [{"byteLength": 168)" +
         (uri.empty() ? "" : R"(, "uri": ")" + uri + "\"") + "}]}";
}

inline std::string document(const std::string& nodes = R"([{"mesh": 0}])") {
  return document(nodes, data_uri(box_buffer()));
}

/// `text` with the first `from` replaced; empty if there is none.
inline std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  return at == std::string::npos ? "" : text.replace(at, from.size(), to);
}

inline std::string binary_file(std::string text, const std::string& data) {
  while (text.size() % 4 != 0) text += ' ';
  std::string bytes;
  append(bytes, 0x46546C67);
  append(bytes, 2);
  append(bytes, static_cast<std::uint32_t>(28 + text.size() + data.size()));
  append(bytes, static_cast<std::uint32_t>(text.size()));
  append(bytes, 0x4E4F534A);
  bytes += text;
  append(bytes, static_cast<std::uint32_t>(data.size()));
  append(bytes, 0x004E4942);
  return bytes + data;
}

}  // namespace palpate::stimuli::gltf
