// glTF 2.0 (Khronos 2021; .gltf and .glb): triangles of the default scene's nodes, each primitive a
// group. Materials, skins and animations do not describe the solid.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <nlohmann/json.hpp>
#include <optional>

#include "stimuli/base64.h"
#include "stimuli/mesh_text.h"

namespace palpate::stimuli {
namespace {

using nlohmann::json;
using Matrix = glm::dmat4;

constexpr int kMostNested = 100;  // nodes within nodes
constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8U | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

/// What a reader gives up with: expected, found.
struct Refused {
  std::string expected, found;
};

class GltfReader {
 public:
  explicit GltfReader(std::string_view bytes) : bytes_(bytes) {}

  /// Where in the document reading stands, as a JSON pointer.
  const std::string& place() const { return place_; }

  PolygonSoup read() {
    root_ = json::parse(take_chunks());
    check_version();
    read_buffers();
    if (root_.contains("scenes") && !root_["scenes"].empty()) {
      for (const json& node :
           member(entry("scenes", root_.value("scene", std::size_t{0})), "nodes"))
        read_node(node.get<std::size_t>(), Matrix(1), 0);
    } else {
      read_roots();
    }
    place_.clear();
    if (soup_.faces.empty()) throw Refused{"at least one triangle", "none"};
    soup_.coordinate_error = largest_ * 0x1p-24;
    if (soup_.group_names.size() == 1) {
      soup_.group_names.clear();
      soup_.group_of.clear();
    }
    return std::move(soup_);
  }

 private:
  // A .glb is a header and chunks; a .gltf is its JSON alone.
  std::string_view take_chunks() {
    if (bytes_.size() < 20 || word_at(bytes_, 0) != kMagic) return bytes_;
    if (word_at(bytes_, 4) != 2)
      throw Refused{"glTF version 2", std::to_string(word_at(bytes_, 4))};
    std::string_view text;
    for (std::size_t at = 12; at + 8 <= bytes_.size();) {
      const std::size_t length = word_at(bytes_, at);
      if (length > bytes_.size() - at - 8) {
        throw Refused{
            "a chunk of " + std::to_string(length) + " bytes at byte " + std::to_string(at),
            std::to_string(bytes_.size() - at - 8)};
      }
      const std::string_view chunk = bytes_.substr(at + 8, length);
      if (word_at(bytes_, at + 4) == kJsonChunk && text.empty()) text = chunk;
      if (word_at(bytes_, at + 4) == kBinaryChunk && !binary_) binary_ = chunk;
      at += 8 + length;
    }
    if (text.empty()) throw Refused{"a chunk of JSON", "none"};
    return text;
  }

  void check_version() {
    place_ = "/asset/version";
    const std::string version = root_.at("asset").at("version");
    if (version.substr(0, 2) != "2.") throw Refused{"2.0", in_quotes(version)};
    place_ = "/extensionsRequired";
    for (const json& extension : root_.value("extensionsRequired", json::array())) {
      throw Refused{"a file that needs no extension (export without compression)",
                    in_quotes(extension.get<std::string>())};
    }
  }

  void read_buffers() {
    const json& list = root_.contains("buffers") ? root_["buffers"] : json::array();
    for (std::size_t i = 0; i < list.size(); ++i) {
      place_ = "/buffers/" + std::to_string(i) + "/uri";
      if (!list[i].contains("uri")) {
        if (i > 0 || !binary_) throw Refused{"data", "none"};
        buffers_.emplace_back(*binary_);
        continue;
      }
      const std::string uri = list[i].at("uri");
      const std::size_t comma = uri.find(";base64,");
      if (uri.rfind("data:", 0) != 0 || comma == std::string::npos)
        throw Refused{"data that were read with the file", in_quotes(uri)};
      std::optional<std::string> data = base64_decoded(std::string_view(uri).substr(comma + 8));
      if (!data) throw Refused{"base64", in_quotes(uri)};
      buffers_.push_back(std::move(*data));
    }
  }

  const json& entry(const char* list, std::size_t index) {
    place_ = std::string("/").append(list).append("/").append(std::to_string(index));
    return root_.at(list).at(index);
  }

  static const json& member(const json& object, const char* key) {
    static const json kNone = json::array();
    const auto found = object.find(key);
    return found == object.end() ? kNone : *found;
  }

  // Without a scene: the nodes that no other has, or the meshes as they are.
  void read_roots() {
    const std::size_t count = member(root_, "nodes").size();
    std::vector<char> child(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      for (const json& c : member(entry("nodes", i), "children"))
        child.at(c.get<std::size_t>()) = 1;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (child[i] == 0) read_node(i, Matrix(1), 0);
    }
    if (count > 0) return;
    for (std::size_t i = 0; i < member(root_, "meshes").size(); ++i)
      read_mesh(i, "mesh " + std::to_string(i), Matrix(1));
  }

  static Matrix matrix_of(const json& node) {
    Matrix matrix(1);
    if (node.contains("matrix")) {
      for (int i = 0; i < 16; ++i)
        matrix[i / 4][i % 4] = node["matrix"].at(static_cast<std::size_t>(i));
      return matrix;
    }
    const auto number = [&](const char* key, std::size_t i, double otherwise) -> double {
      return node.contains(key) ? node[key].at(i).get<double>() : otherwise;
    };
    const Quat q(number("rotation", 3, 1), number("rotation", 0, 0), number("rotation", 1, 0),
                 number("rotation", 2, 0));
    const Mat3 turn = glm::mat3_cast(q);
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      for (int row = 0; row < 3; ++row) matrix[axis][row] = turn[axis][row] * number("scale", i, 1);
      matrix[3][axis] = number("translation", i, 0);
    }
    return matrix;
  }

  void read_node(std::size_t index, const Matrix& parent, int depth) {
    const json& node = entry("nodes", index);
    if (depth > kMostNested) throw Refused{"nodes within at most 100 others", "a deeper one"};
    const Matrix world = parent * matrix_of(node);
    if (node.contains("mesh"))
      read_mesh(node["mesh"].get<std::size_t>(),
                node.value("name", "node " + std::to_string(index)), world);
    for (const json& child : member(node, "children"))
      read_node(child.get<std::size_t>(), world, depth + 1);
  }

  void read_mesh(std::size_t index, const std::string& name, const Matrix& world) {
    const json& primitives = member(entry("meshes", index), "primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      place_ = "/meshes/" + std::to_string(index) + "/primitives/" + std::to_string(i);
      const json& primitive = primitives[i];
      if (primitive.value("mode", 4) != 4)
        throw Refused{"triangles (mode 4)", std::to_string(primitive.value("mode", 4))};
      soup_.group_names.push_back(primitives.size() == 1 ? name : name + "/" + std::to_string(i));
      add_triangles(primitive, world);
    }
  }

  void add_triangles(const json& primitive, const Matrix& world) {
    const std::size_t first = soup_.vertices.size();
    const auto positions = primitive.at("attributes").at("POSITION").get<std::size_t>();
    const std::size_t count = add_positions(positions, world);
    std::vector<std::uint32_t> corners;
    if (primitive.contains("indices")) {
      corners = indices(primitive["indices"].get<std::size_t>());
    } else {
      for (std::size_t i = 0; i < count; ++i) corners.push_back(static_cast<std::uint32_t>(i));
    }
    if (corners.size() % 3 != 0)
      throw Refused{"three corners for each triangle", std::to_string(corners.size())};
    const bool mirrored = glm::determinant(Mat3(world)) < 0;
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      std::vector<std::uint32_t> face;
      for (const std::size_t k : {i, mirrored ? i + 2 : i + 1, mirrored ? i + 1 : i + 2}) {
        if (corners[k] >= count)
          throw Refused{"indices below " + std::to_string(count), std::to_string(corners[k])};
        face.push_back(static_cast<std::uint32_t>(first + corners[k]));
      }
      soup_.faces.push_back(std::move(face));
      soup_.group_of.push_back(static_cast<std::uint32_t>(soup_.group_names.size() - 1));
    }
  }

  struct Values {
    std::string_view data;
    std::size_t count, stride;
  };

  Values values(std::size_t accessor, const char* type, std::size_t bytes_each) {
    const json& a = entry("accessors", accessor);
    if (a.at("type") != type) throw Refused{std::string("type ") + type, a["type"].dump()};
    if (a.contains("sparse") || !a.contains("bufferView"))
      throw Refused{"values in a bufferView", "sparse or none"};
    const auto count = a.at("count").get<std::size_t>();
    const auto offset = a.value("byteOffset", std::size_t{0});
    const json& view = entry("bufferViews", a["bufferView"].get<std::size_t>());
    const std::size_t stride = view.value("byteStride", bytes_each);
    const auto start = view.value("byteOffset", std::size_t{0});
    const auto length = view.at("byteLength").get<std::size_t>();
    const std::string& buffer = buffers_.at(view.at("buffer").get<std::size_t>());
    const bool fits = start <= buffer.size() && length <= buffer.size() - start &&
                      stride >= bytes_each && offset <= length &&
                      (count == 0 || (length - offset >= bytes_each &&
                                      (count - 1) <= (length - offset - bytes_each) / stride));
    if (!fits)
      throw Refused{"room for " + std::to_string(count) + " values",
                    std::to_string(length) + " bytes"};
    return {std::string_view(buffer).substr(start + offset, length - offset), count, stride};
  }

  // glTF has +y up and +z towards the viewer; here z is up and y leads away.
  std::size_t add_positions(std::size_t accessor, const Matrix& world) {
    if (entry("accessors", accessor).at("componentType") != 5126)
      throw Refused{"positions in single precision (componentType 5126)",
                    entry("accessors", accessor)["componentType"].dump()};
    const Values all = values(accessor, "VEC3", 12);
    double scale = 0;
    for (int axis = 0; axis < 3; ++axis)
      scale = std::max(scale, std::sqrt(glm::dot(Mat3(world)[axis], Mat3(world)[axis])));
    for (std::size_t i = 0; i < all.count; ++i) {
      glm::dvec4 local(0, 0, 0, 1);
      for (int axis = 0; axis < 3; ++axis) {
        local[axis] = std::bit_cast<float>(
            word_at(all.data, i * all.stride + 4 * static_cast<std::size_t>(axis)));
        largest_ = std::max(largest_, scale * std::abs(local[axis]));
      }
      const glm::dvec4 placed = world * local;
      if (!std::isfinite(placed.x + placed.y + placed.z))
        throw Refused{"finite coordinates", "others, at vertex " + std::to_string(i)};
      soup_.vertices.emplace_back(placed.x, -placed.z, placed.y);
    }
    return all.count;
  }

  std::vector<std::uint32_t> indices(std::size_t accessor) {
    const int type = entry("accessors", accessor).at("componentType");
    const std::size_t size = type == 5121 ? 1 : type == 5123 ? 2 : type == 5125 ? 4 : 0;
    if (size == 0) throw Refused{"unsigned indices (5121, 5123, 5125)", std::to_string(type)};
    const Values all = values(accessor, "SCALAR", size);
    std::vector<std::uint32_t> corners(all.count, 0);
    for (std::size_t i = 0; i < all.count; ++i) {
      for (std::size_t b = size; b-- > 0;)
        corners[i] = corners[i] << 8U | static_cast<unsigned char>(all.data[i * all.stride + b]);
    }
    return corners;
  }

  std::string_view bytes_;
  std::optional<std::string_view> binary_;
  json root_;
  std::vector<std::string> buffers_;
  std::string place_;
  PolygonSoup soup_;
  double largest_ = 0;  // m, of the coordinates as they stand in the file
};

}  // namespace

PolygonSoup read_gltf(std::string_view bytes, FileFaults& faults) {
  GltfReader reader(bytes);
  try {
    return reader.read();
  } catch (const Refused& refused) {
    faults.add(reader.place(), refused.expected, refused.found);
  } catch (const json::exception& error) {
    faults.add(reader.place(), "glTF 2.0", error.what());
  } catch (const std::out_of_range&) {
    faults.add(reader.place(), "the number of something that is there", "another");
  }
  return {};
}

std::string with_buffers(const std::string& bytes,
                         const std::function<std::string(const std::string&)>& contents_of) {
  json root = json::parse(bytes, nullptr, false);
  if (!root.is_object() || !root.contains("buffers") || !root["buffers"].is_array()) return bytes;
  bool changed = false;
  for (json& buffer : root["buffers"]) {
    if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
    const std::string uri = buffer["uri"];
    if (uri.rfind("data:", 0) == 0) continue;
    buffer["uri"] = "data:application/octet-stream;base64," + base64_encoded(contents_of(uri));
    changed = true;
  }
  return changed ? root.dump() : bytes;
}

}  // namespace palpate::stimuli
