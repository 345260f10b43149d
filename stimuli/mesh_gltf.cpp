// glTF 2.0 (Khronos 2021; .gltf and .glb): triangles of the default scene's nodes, each primitive a
// group. Materials, skins and animations do not describe the solid.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "stimuli/base64.h"
#include "stimuli/mesh_gltf_accessors.h"
#include "stimuli/mesh_gltf_document.h"
#include "stimuli/mesh_text.h"

namespace palpate::stimuli {
namespace {

using Matrix = glm::dmat4;
using Triangle = std::array<std::uint32_t, 3>;

constexpr int kMostNested = 100;  // nodes within nodes
// Vertices, and triangles, of all nodes: a file may use a mesh again and again, but must not need
// memory out of proportion to its size. Data that are named once have fewer than one for each byte.
constexpr std::size_t kAlwaysRead = 1U << 17U;
constexpr std::size_t kLongestName = 256;  // bytes; every primitive is named after its node
constexpr double kUnitError = 1e-3;        // of a quaternion's length: what a few digits leave

double number_at(const GltfValue& list, std::size_t i) { return list.element(i).number(); }

Matrix given_matrix(const GltfValue& list) {
  list.require_numbers(16);
  Matrix matrix(1);
  for (std::size_t i = 0; i < 16; ++i)
    matrix[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = number_at(list, i);
  for (std::size_t i = 3; i < 16; i += 4) {
    if (std::abs(number_at(list, i) - (i == 15 ? 1 : 0)) > 1e-6)
      list.element(i).refuse(i == 15 ? "1 (no perspective)" : "0 (no perspective)");
  }
  return matrix;
}

/// Of a rotation [x, y, z, w].
Mat3 turn_of(const GltfValue& list) {
  if (!list.present()) return Mat3(1);
  list.require_numbers(4);
  const Quat q(number_at(list, 3), number_at(list, 0), number_at(list, 1), number_at(list, 2));
  const double length = glm::length(q);
  if (!(std::abs(length - 1) <= kUnitError)) {
    char text[64];
    std::snprintf(text, sizeof text, "one of length %.6g", length);
    throw GltfRefused{list.place(), "a unit quaternion [x, y, z, w] (within 0.001)", text};
  }
  return glm::mat3_cast(q / length);
}

Vec3 vector_of(const GltfValue& list, double otherwise) {
  if (!list.present()) return Vec3(otherwise);
  list.require_numbers(3);
  return {number_at(list, 0), number_at(list, 1), number_at(list, 2)};
}

Matrix matrix_of(const GltfValue& node) {
  if (const GltfValue matrix = node.member("matrix"); matrix.present()) return given_matrix(matrix);
  const Vec3 scale = vector_of(node.member("scale"), 1);
  const Mat3 turn = turn_of(node.member("rotation"));
  Matrix matrix(1);
  for (int axis = 0; axis < 3; ++axis) matrix[axis] = glm::dvec4(turn[axis] * scale[axis], 0);
  matrix[3] = glm::dvec4(vector_of(node.member("translation"), 0), 1);
  return matrix;
}

/// The triangles of a primitive, counter-clockwise seen from outside (glTF 2.0, 3.7.2.1).
std::vector<Triangle> triangles_of(std::size_t mode, const std::vector<std::uint32_t>& corners,
                                   const GltfValue& primitive) {
  std::vector<Triangle> triangles;
  const bool separate = mode == 4, strip = mode == 5;
  if (corners.size() < 3 || (separate && corners.size() % 3 != 0)) {
    throw GltfRefused{primitive.place(), "three corners for each triangle",
                      std::to_string(corners.size())};
  }
  for (std::size_t i = 0; i + 2 < corners.size(); i += separate ? 3 : 1) {
    const bool turned = strip && i % 2 == 1;
    if (separate || strip) {
      triangles.push_back(
          {corners[i], corners[turned ? i + 2 : i + 1], corners[turned ? i + 1 : i + 2]});
    } else {
      triangles.push_back({corners[i + 1], corners[i + 2], corners[0]});
    }
  }
  return triangles;
}

class GltfReader {
 public:
  explicit GltfReader(std::string_view bytes)
      : document_(bytes), data_(document_), most_(std::max(bytes.size(), kAlwaysRead)) {}

  PolygonSoup read() {
    reached_.assign(document_.list("nodes").size(), 0);
    const GltfValue scenes = document_.list("scenes");
    if (scenes.size() > 0) {
      const GltfValue named = document_.list("scene");
      const GltfValue nodes =
          scenes.element(named.present() ? named.number_of("scene", scenes.size()) : 0)
              .member("nodes");
      for (std::size_t i = 0; i < nodes.size(); ++i) read_node(nodes.element(i), Matrix(1), 0);
    } else if (!reached_.empty()) {
      read_roots();
    } else {
      const GltfValue meshes = document_.list("meshes");
      for (std::size_t i = 0; i < meshes.size(); ++i)
        read_mesh(meshes.element(i), GltfValue(nullptr, ""), "mesh " + std::to_string(i),
                  Matrix(1));
    }
    if (soup_.faces.empty()) throw GltfRefused{"", "at least one triangle", "none"};
    soup_.coordinate_error = largest_ * 0x1p-24;
    if (soup_.group_names.size() == 1) {
      soup_.group_names.clear();
      soup_.group_of.clear();
    }
    soup_.names = std::make_shared<const MeshNames>(std::move(names_));
    return std::move(soup_);
  }

 private:
  // Without a scene: the nodes that no other has.
  void read_roots() {
    const GltfValue nodes = document_.list("nodes");
    std::vector<char> is_child(nodes.size(), 0);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const GltfValue children = nodes.element(i).member("children");
      for (std::size_t k = 0; k < children.size(); ++k)
        is_child[children.element(k).number_of("node", nodes.size())] = 1;
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (is_child[i] == 0) enter_node(i, nodes.element(i), Matrix(1), 0);
    }
  }

  // Nodes are strict trees (glTF 2.0, 3.5.2).
  void read_node(const GltfValue& number, const Matrix& parent, int depth) {
    const GltfValue node = document_.named_by(number, "nodes", "node");
    const std::size_t index = number.number_of("node", reached_.size());
    if (reached_[index] != 0)
      number.refuse("a node that has one parent, or none, and is in the scene once");
    enter_node(index, node, parent, depth);
  }

  void enter_node(std::size_t index, const GltfValue& node, const Matrix& parent, int depth) {
    reached_[index] = 1;
    if (depth > kMostNested)
      throw GltfRefused{node.place(), "nodes within at most 100 others", "a deeper one"};
    const Matrix world = parent * matrix_of(node);
    if (const GltfValue mesh = node.member("mesh"); mesh.present()) {
      if (glm::determinant(Mat3(world)) == 0)
        throw GltfRefused{node.place(), "a mesh that is placed as a solid", "a scale of 0"};
      const GltfValue name = node.member("name");
      read_mesh(document_.named_by(mesh, "meshes", "mesh"), node.member("weights"),
                name.present() ? name_in(name) : "node " + std::to_string(index), world);
    }
    const GltfValue children = node.member("children");
    for (std::size_t i = 0; i < children.size(); ++i)
      read_node(children.element(i), world, depth + 1);
  }

  static std::string name_in(const GltfValue& value) {
    std::string name = value.text("a name");
    if (name.size() > kLongestName)
      value.refuse("a name of at most " + std::to_string(kLongestName) + " bytes");
    return name;
  }

  /// \param count  to be added to `so_far`
  void require_room(std::size_t count, std::size_t so_far, const char* what,
                    const GltfValue& primitive) const {
    if (count <= most_ - so_far) return;
    throw GltfRefused{
        primitive.place(),
        "at most " + std::to_string(most_) + " " + what + " in all nodes, for a file of this size",
        "more"};
  }

  void read_mesh(const GltfValue& mesh, const GltfValue& node_weights, const std::string& name,
                 const Matrix& world) {
    const GltfValue weights = node_weights.present() ? node_weights : mesh.member("weights");
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (number_at(weights, i) != 0) weights.element(i).refuse("0 (export without morph targets)");
    }
    const GltfValue primitives = mesh.member("primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      soup_.group_names.push_back(primitives.size() == 1 ? name : name + "/" + std::to_string(i));
      names_.places.push_back(primitives.element(i).place() + " in '" + name + "'");
      add_primitive(primitives.element(i), world);
    }
  }

  void add_primitive(const GltfValue& primitive, const Matrix& world) {
    const GltfValue mode = primitive.member("mode");
    const std::size_t kind = mode.whole_or(4, "4, 5 or 6 (triangles)");
    if (kind < 4 || kind > 6) mode.refuse("4, 5 or 6 (triangles)");
    const GltfValue source = primitive.member("attributes").member("POSITION");
    const std::size_t count = data_.count(source);
    require_room(count, soup_.vertices.size(), "vertices", primitive);
    const std::size_t first = soup_.vertices.size();
    add_vertices(data_.positions(source), world, primitive);
    std::vector<std::uint32_t> corners;
    if (const GltfValue indices = primitive.member("indices"); indices.present()) {
      corners = data_.indices(indices, count);
    } else {
      for (std::size_t i = 0; i < count; ++i) corners.push_back(static_cast<std::uint32_t>(i));
    }
    add_triangles(triangles_of(kind, corners, primitive), first, world, primitive);
  }

  std::uint32_t group() const { return static_cast<std::uint32_t>(soup_.group_names.size() - 1); }

  // glTF has +y up and +z towards the viewer; here z is up and y leads away.
  void add_vertices(const std::vector<Vec3>& positions, const Matrix& world,
                    const GltfValue& primitive) {
    double scale = 0;
    for (int axis = 0; axis < 3; ++axis) scale = std::max(scale, glm::length(Mat3(world)[axis]));
    for (std::uint32_t i = 0; i < positions.size(); ++i) {
      const Vec3 &local = positions[i], far = glm::abs(local);
      largest_ = std::max(largest_, scale * std::max({far.x, far.y, far.z}));
      const glm::dvec4 placed = world * glm::dvec4(local, 1);
      if (!std::isfinite(placed.x + placed.y + placed.z))
        throw GltfRefused{primitive.place(), "finite coordinates where its node places it",
                          "others"};
      names_.vertices.push_back({i, group()});
      soup_.vertices.emplace_back(placed.x, -placed.z, placed.y);
    }
  }

  void add_triangles(const std::vector<Triangle>& triangles, std::size_t first, const Matrix& world,
                     const GltfValue& primitive) {
    require_room(triangles.size(), soup_.faces.size(), "triangles", primitive);
    const bool mirrored = glm::determinant(Mat3(world)) < 0;
    const auto start = static_cast<std::uint32_t>(first);
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const auto& [a, b, c] = triangles[i];
      names_.faces.push_back({i, group()});
      soup_.faces.push_back({start + a, start + (mirrored ? c : b), start + (mirrored ? b : c)});
      soup_.group_of.push_back(group());
    }
  }

  GltfDocument document_;
  GltfAccessors data_;
  std::size_t most_;           // vertices, and triangles
  std::vector<char> reached_;  // of each node
  PolygonSoup soup_;
  MeshNames names_;
  double largest_ = 0;  // m, of the coordinates as they stand in the file
};

}  // namespace

PolygonSoup read_gltf(std::string_view bytes, FileFaults& faults) {
  try {
    return GltfReader(bytes).read();
  } catch (const GltfRefused& refused) {
    faults.add(refused.place, refused.expected, refused.found);
  }
  return {};
}

std::string with_buffers(const std::string& bytes, const ContentsOf& contents_of) {
  using nlohmann::json;
  json root = data::json_or_discarded(bytes);
  if (!root.is_object() || !root.contains("buffers") || !root["buffers"].is_array()) return bytes;
  bool changed = false;
  for (std::size_t i = 0; i < root["buffers"].size(); ++i) {
    json& buffer = root["buffers"][i];
    if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
    const std::string uri = buffer["uri"];
    if (uri.rfind("data:", 0) == 0) continue;
    buffer["uri"] = "data:application/octet-stream;base64," +
                    base64_encoded(contents_of("/buffers/" + std::to_string(i) + "/uri", uri));
    changed = true;
  }
  return changed ? root.dump() : bytes;
}

}  // namespace palpate::stimuli
