#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/base64.h"
#include "data/base/input_file.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "stimuli/mesh_formats.h"
#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
namespace {

// A glTF document: its JSON, each value with its place, and the data of a .glb.

/// Thrown to stop reading.
struct GltfRefused {
  std::string place;  ///< a JSON pointer, a line or a byte; empty: the file
  std::string expected, found;
};

using nlohmann::json;

/// A value of the document, or none, and its place. Every read is checked: GltfRefused says what
/// was expected there and what was found.
class GltfValue {
 public:
  /// \param value  nullptr: none; not owned
  GltfValue(const nlohmann::json* value, std::string place)
      : value_(value), place_(std::move(place)) {}

  const std::string& place() const { return place_; }
  bool present() const { return value_ != nullptr; }
  [[noreturn]] void refuse(const std::string& expected) const;

  GltfValue member(const char* key) const;       ///< of an object; none where it has no such key
  GltfValue element(std::size_t index) const;    ///< of a list; must be there
  std::size_t size() const;                      ///< of a list; none: 0
  std::string text(const char* expected) const;  ///< \param expected  "a name"
  double number() const;                         ///< finite
  bool is_true() const;                          ///< none: false
  /// A whole number from 0 to 2^53, also written as 3.0.
  /// \param expected  "a number of bytes"
  std::size_t whole(const std::string& expected) const;
  std::size_t whole_or(std::size_t otherwise, const std::string& expected) const {
    return present() ? whole(expected) : otherwise;
  }
  /// The number of one of `count` things. \param kind  "mesh"
  std::size_t number_of(const char* kind, std::size_t count) const;
  void require_numbers(std::size_t count) const;  ///< a list of so many numbers

 private:
  std::optional<std::size_t> as_whole() const;
  const nlohmann::json* value_;
  std::string place_;
};

class GltfDocument {
 public:
  /// \param bytes  of a .gltf or .glb; must live as long as the document \throws GltfRefused
  explicit GltfDocument(std::string_view bytes);

  GltfValue root() const { return {&root_, ""}; }
  GltfValue list(const char* name) const { return root().member(name); }
  /// The entry that a value names by its number. \param kind  of the list's entries, "mesh"
  GltfValue named_by(const GltfValue& number, const char* list_name, const char* kind) const;
  bool requires_extension(std::string_view name) const;
  /// The data chunk of a .glb.
  const std::optional<std::string_view>& binary() const { return binary_; }

 private:
  std::string_view take_chunks(std::string_view bytes);

  std::optional<std::string_view> binary_;
  nlohmann::json root_;
};

// The data of a glTF document: buffers, and accessors that read them.

/// Every function throws GltfRefused.
class GltfAccessors {
 public:
  /// \param most  values of an accessor: memory stays in proportion to the file
  GltfAccessors(const GltfDocument& document, std::size_t most);

  /// How many values an accessor has. \param number  the value that names the accessor
  std::size_t count(const GltfValue& number) const;
  /// m, as they stand: single precision or, with KHR_mesh_quantization, integers; glTF's axes.
  std::vector<Vec3> positions(const GltfValue& number) const;
  /// Numbers of vertices. \param vertices  how many there are; all are below it
  std::vector<std::uint32_t> indices(const GltfValue& number, std::size_t vertices) const;

 private:
  /// Values where they lie in a buffer.
  struct Values {
    std::string_view data;
    std::size_t stride;  ///< bytes
  };
  GltfValue accessor(const GltfValue& number) const;
  std::size_t count_of(const GltfValue& accessor) const;
  std::string packed(const GltfValue& accessor, std::size_t bytes_each) const;
  void put_sparse(const GltfValue& sparse, std::size_t bytes_each, std::string& all) const;
  Values values(const GltfValue& source, std::size_t count, std::size_t bytes_each) const;
  std::string_view view_of(const GltfValue& source, std::size_t bytes_each,
                           std::size_t& stride) const;

  const GltfDocument& document_;
  const std::size_t most_;
  std::vector<std::string> buffers_;
};

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kFileHeader = 12, kChunkFileHeader = 8;

std::string byte_place(std::size_t at) { return "byte " + std::to_string(at); }

// A message quotes at most this much of the text found.
constexpr std::size_t kShownBytes = 60;

std::string found_text(const json* value) {
  if (value == nullptr) return "nothing";
  if (value->is_object()) return "an object";
  if (value->is_array()) return "a list of " + std::to_string(value->size());
  return printable(value->dump(), kShownBytes);
}

json parsed(std::string_view text) {
  try {
    return read_json(text);
  } catch (const JsonError& error) {
    if (!error.byte) throw GltfRefused{"", error.expected, error.found};
    const std::size_t at = *error.byte;
    const auto line =
        1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    std::size_t begin = text.substr(0, at).find_last_of('\n') + 1;  // 0 where there is none
    if (at - begin > 20) begin = at - 20;
    const std::string rest(text.substr(begin, std::min(text.find('\n', at), text.size()) - begin));
    throw GltfRefused{"line " + std::to_string(line), "JSON (glTF 2.0)",
                      at >= text.size() ? std::string("the end of the text")
                                        : "\"" + printable(rest, kShownBytes) + "\""};
  }
}

// Positions as integers of 8 or 16 bits.
constexpr const char* kQuantization = "KHR_mesh_quantization";

// The solid does not depend on how it looks.
bool changes_looks_only(std::string_view extension) {
  constexpr std::array<std::string_view, 8> kLooks{
      "KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
      "MSFT_packing_",  "KHR_lights_",  "EXT_lights_",  "KHR_xmp"};
  return std::any_of(kLooks.begin(), kLooks.end(),
                     [&](std::string_view start) { return extension.starts_with(start); });
}

void require_known(const GltfValue& extension) {
  const std::string name = extension.text("the name of an extension");
  if (name == kQuantization || changes_looks_only(name)) return;
  if (name == "KHR_draco_mesh_compression" || name == "EXT_meshopt_compression") {
    extension.refuse(
        "a file without compression (npx @gltf-transform/cli copy COMPRESSED.glb PLAIN.glb)");
  }
  extension.refuse("a file that needs no extension but KHR_mesh_quantization and those of looks");
}

void GltfValue::refuse(const std::string& expected) const {
  throw GltfRefused{place_, expected, found_text(value_)};
}

GltfValue GltfValue::member(const char* key) const {
  if (!present() || !value_->is_object()) refuse("an object");
  const auto at = value_->find(key);
  return {at == value_->end() ? nullptr : &*at, place_ + "/" + key};
}

GltfValue GltfValue::element(std::size_t index) const {
  if (index >= size()) refuse("a list of at least " + std::to_string(index + 1));
  return {&(*value_)[index], place_ + "/" + std::to_string(index)};
}

std::size_t GltfValue::size() const {
  if (present() && !value_->is_array()) refuse("a list");
  return present() ? value_->size() : 0;
}

std::string GltfValue::text(const char* expected) const {
  if (!present() || !value_->is_string()) refuse(expected);
  return value_->get<std::string>();
}

double GltfValue::number() const {
  if (!present() || !value_->is_number()) refuse("a number");
  return value_->get<double>();
}

bool GltfValue::is_true() const {
  if (present() && !value_->is_boolean()) refuse("true or false");
  return present() && value_->get<bool>();
}

std::optional<std::size_t> GltfValue::as_whole() const {
  if (!present() || !value_->is_number()) return std::nullopt;
  const double value = value_->get<double>();
  if (!(value >= 0 && value <= 0x1p53) || value != std::floor(value)) return std::nullopt;
  return static_cast<std::size_t>(value);
}

std::size_t GltfValue::whole(const std::string& expected) const {
  const std::optional<std::size_t> value = as_whole();
  if (!value) refuse(expected);
  return *value;
}

std::size_t GltfValue::number_of(const char* kind, std::size_t count) const {
  const bool vowel = std::string_view("aeiou").find(kind[0]) != std::string_view::npos;
  const std::string named = std::string("the number of a") + (vowel ? "n " : " ") + kind;
  const std::optional<std::size_t> value = as_whole();
  if (value && *value < count) return *value;
  refuse(count == 0 ? named + ", but there are none"
                    : named + " from 0 to " + std::to_string(count - 1));
}

void GltfValue::require_numbers(std::size_t count) const {
  if (!present() || !value_->is_array() || value_->size() != count)
    refuse("a list of " + std::to_string(count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) element(i).number();
}

GltfDocument::GltfDocument(std::string_view bytes) : root_(parsed(take_chunks(bytes))) {
  if (!root_.is_object()) root().refuse("a JSON object");
  const GltfValue version = root().member("asset");
  if (!version.present()) version.refuse("an object with the version of glTF");
  if (!version.member("version").text("\"2.0\"").starts_with("2."))
    version.member("version").refuse("\"2.0\"");
  const GltfValue extensions = list("extensionsRequired");
  for (std::size_t i = 0; i < extensions.size(); ++i) require_known(extensions.element(i));
}

GltfValue GltfDocument::named_by(const GltfValue& number, const char* list_name,
                                 const char* kind) const {
  const GltfValue all = list(list_name);
  return all.element(number.number_of(kind, all.size()));
}

bool GltfDocument::requires_extension(std::string_view name) const {
  const GltfValue extensions = list("extensionsRequired");
  for (std::size_t i = 0; i < extensions.size(); ++i) {
    if (extensions.element(i).text("the name of an extension") == name) return true;
  }
  return false;
}

// A .glb is a header and chunks; a .gltf is its JSON alone.
std::string_view GltfDocument::take_chunks(std::string_view bytes) {
  if (bytes.size() < 4 || little_endian(bytes, 0) != kMagic) return bytes;
  const std::string size = std::to_string(bytes.size()) + " bytes";
  if (bytes.size() < kFileHeader + kChunkFileHeader)
    throw GltfRefused{byte_place(0), "the headers of a .glb, 20 bytes", size};
  if (little_endian(bytes, 4) != 2)
    throw GltfRefused{byte_place(4), "glTF version 2", std::to_string(little_endian(bytes, 4))};
  if (little_endian(bytes, 8) != bytes.size()) {
    throw GltfRefused{byte_place(8),
                      "a file of " + std::to_string(little_endian(bytes, 8)) + " bytes", size};
  }
  std::optional<std::string_view> text;
  for (std::size_t at = kFileHeader; at < bytes.size();) {
    const std::size_t left = bytes.size() - at;
    if (left < kChunkFileHeader)
      throw GltfRefused{byte_place(at), "the header of a chunk, 8 bytes",
                        std::to_string(left) + " bytes"};
    const std::size_t length = little_endian(bytes, at), kind = little_endian(bytes, at + 4);
    if (length > left - kChunkFileHeader) {
      throw GltfRefused{byte_place(at), "a chunk of " + std::to_string(length) + " bytes",
                        std::to_string(left - kChunkFileHeader) + " bytes"};
    }
    const std::string_view chunk = bytes.substr(at + kChunkFileHeader, length);
    if (!text && kind != kJsonChunk)
      throw GltfRefused{byte_place(at + 4), "the chunk of JSON first", "another"};
    if (!text) text = chunk;
    if (kind == kBinaryChunk && !binary_) binary_ = chunk;
    at += kChunkFileHeader + length;
  }
  return *text;
}

/// A number of an accessor by its componentType (glTF 2.0, 3.6.2.2).
struct Component {
  std::size_t type, bytes;
  double most;  ///< of a normalised integer; a position of this value is 1
  bool is_signed;
};
constexpr std::array<Component, 5> kIntegers{{{5120, 1, 127, true},
                                              {5121, 1, 255, false},
                                              {5122, 2, 32767, true},
                                              {5123, 2, 65535, false},
                                              {5125, 4, 0, false}}};
constexpr std::size_t kFloat = 5126;
constexpr const char* kBytes = "a number of bytes";

std::string of_uri(const GltfValue& uri) {
  const std::string text = uri.text("a text");
  const std::size_t comma = text.find(";base64,");
  // Files that a .gltf names were put into it when it was read (with_buffers).
  if (!text.starts_with("data:") || comma == std::string::npos)
    uri.refuse("data in base64 (a .glb has no other files)");
  std::optional<std::string> data = base64_decoded(std::string_view(text).substr(comma + 8));
  if (!data) uri.refuse("data in base64");
  return std::move(*data);
}

/// \return bytes of an unsigned number of a vertex or value
std::size_t index_bytes(const GltfValue& component) {
  const std::string kinds = "5121, 5123 or 5125 (unsigned indices)";
  const std::size_t type = component.whole(kinds);
  for (const Component& known : kIntegers) {
    if (known.type == type && !known.is_signed) return known.bytes;
  }
  component.refuse(kinds);
}

/// How a coordinate of a position is written.
class PositionNumber {
 public:
  /// \throws GltfRefused: not in single precision, and no integer that the file announces
  PositionNumber(const GltfDocument& document, const GltfValue& accessor)
      : is_normalised_(accessor.member("normalized").is_true()) {
    const GltfValue component = accessor.member("componentType");
    const std::string kinds = "5126 (positions in single precision)";
    const std::size_t type = component.whole(kinds);
    if (type == kFloat) return;
    const auto* const known =
        std::find_if(kIntegers.begin(), kIntegers.end(),
                     [&](const Component& c) { return c.type == type && c.bytes <= 2; });
    if (known == kIntegers.end()) component.refuse(kinds);
    if (!document.requires_extension(kQuantization))
      component.refuse(kinds + ", or " + kQuantization + " in extensionsRequired");
    integer_ = *known;
  }

  std::size_t bytes() const { return integer_ ? integer_->bytes : 4; }

  /// \return m, before the node's transform; may be NaN or infinite
  double at(std::string_view data, std::size_t byte) const {
    const std::uint32_t bits = little_endian(data, byte, bytes());
    if (!integer_) return std::bit_cast<float>(bits);
    const double steps = 2 * (integer_->most + 1);
    double value = bits;
    if (integer_->is_signed && value > integer_->most) value -= steps;
    return is_normalised_ ? std::max(value / integer_->most, -1.0) : value;
  }

 private:
  bool is_normalised_;
  std::optional<Component> integer_;  ///< none: single precision
};

GltfAccessors::GltfAccessors(const GltfDocument& document, std::size_t most)
    : document_(document), most_(most) {
  const GltfValue list = document.list("buffers");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const GltfValue buffer = list.element(i), uri = buffer.member("uri");
    if (!uri.present() && (i > 0 || !document.binary())) uri.refuse("where its data are");
    buffers_.push_back(uri.present() ? of_uri(uri) : std::string(*document.binary()));
    const GltfValue length = buffer.member("byteLength");
    if (length.whole(kBytes) > buffers_.back().size()) {
      throw GltfRefused{length.place(), std::to_string(length.whole(kBytes)) + " bytes of data",
                        std::to_string(buffers_.back().size())};
    }
  }
}

GltfValue GltfAccessors::accessor(const GltfValue& number) const {
  return document_.named_by(number, "accessors", "accessor");
}

std::size_t GltfAccessors::count(const GltfValue& number) const {
  return accessor(number).member("count").whole("a number of values");
}

std::size_t GltfAccessors::count_of(const GltfValue& accessor) const {
  const GltfValue count = accessor.member("count");
  const std::size_t values = count.whole("a number of values");
  if (values == 0) count.refuse("one value or more");
  if (values > most_)
    count.refuse("at most " + std::to_string(most_) + " values, for a file of this size");
  return values;
}

std::string_view GltfAccessors::view_of(const GltfValue& source, std::size_t bytes_each,
                                        std::size_t& stride) const {
  const GltfValue view =
      document_.named_by(source.member("bufferView"), "bufferViews", "bufferView");
  const GltfValue step = view.member("byteStride"), length = view.member("byteLength");
  stride = step.whole_or(bytes_each, kBytes);
  if (stride < bytes_each || stride > 252)
    step.refuse(std::to_string(bytes_each) + " to 252 bytes from one value to the next");
  const std::string_view buffer =
      buffers_[view.member("buffer").number_of("buffer", buffers_.size())];
  const std::size_t start = view.member("byteOffset").whole_or(0, kBytes);
  if (start > buffer.size() || length.whole(kBytes) > buffer.size() - start) {
    throw GltfRefused{
        view.place(), "at most the " + std::to_string(buffer.size()) + " bytes of its buffer",
        std::to_string(length.whole(kBytes)) + " bytes from byte " + std::to_string(start)};
  }
  return buffer.substr(start, length.whole(kBytes));
}

GltfAccessors::Values GltfAccessors::values(const GltfValue& source, std::size_t count,
                                            std::size_t bytes_each) const {
  Values all{};
  const std::string_view view = view_of(source, bytes_each, all.stride);
  const std::size_t offset = source.member("byteOffset").whole_or(0, kBytes);
  const std::size_t room = offset <= view.size() ? view.size() - offset : 0;
  if (room < bytes_each || (count - 1) > (room - bytes_each) / all.stride) {
    throw GltfRefused{source.place(),
                      "room for " + std::to_string(count) + " values of " +
                          std::to_string(bytes_each) + " bytes in its bufferView",
                      std::to_string(room) + " bytes"};
  }
  all.data = view.substr(offset);
  return all;
}

/// The values of an accessor one after the other; a sparse one without a bufferView begins as
/// zeros (glTF 2.0, 3.6.2.3).
std::string GltfAccessors::packed(const GltfValue& accessor, std::size_t bytes_each) const {
  const std::size_t count = count_of(accessor);
  const GltfValue sparse = accessor.member("sparse");
  std::string all(count * bytes_each, '\0');
  if (accessor.member("bufferView").present() || !sparse.present()) {
    const Values dense = values(accessor, count, bytes_each);
    for (std::size_t i = 0; i < count; ++i)
      dense.data.copy(all.data() + i * bytes_each, bytes_each, i * dense.stride);
  }
  if (sparse.present()) put_sparse(sparse, bytes_each, all);
  return all;
}

void GltfAccessors::put_sparse(const GltfValue& sparse, std::size_t bytes_each,
                               std::string& all) const {
  const std::size_t most = all.size() / bytes_each;
  const std::size_t count = sparse.member("count").whole("a number of values");
  if (count == 0 || count > most)
    sparse.member("count").refuse("1 to " + std::to_string(most) + " values");
  const GltfValue indices = sparse.member("indices"), given = sparse.member("values");
  const std::size_t width = index_bytes(indices.member("componentType"));
  const Values places = values(indices, count, width), other = values(given, count, bytes_each);
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = little_endian(places.data, i * places.stride, width);
    if (place >= most || (before && place <= *before)) {
      throw GltfRefused{indices.place(), "rising numbers of values below " + std::to_string(most),
                        std::to_string(place) + " as number " + std::to_string(i)};
    }
    other.data.copy(all.data() + place * bytes_each, bytes_each, i * other.stride);
    before = place;
  }
}

std::vector<Vec3> GltfAccessors::positions(const GltfValue& number) const {
  const GltfValue source = accessor(number);
  const GltfValue type = source.member("type");
  if (type.text("\"VEC3\"") != "VEC3") type.refuse("\"VEC3\"");
  const PositionNumber read(document_, source);
  const std::string all = packed(source, 3 * read.bytes());
  std::vector<Vec3> positions(all.size() / (3 * read.bytes()));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = read.at(all, (3 * i + axis) * read.bytes());
      if (!std::isfinite(value)) {
        throw GltfRefused{source.place(), "finite coordinates",
                          "infinity or NaN at vertex " + std::to_string(i)};
      }
      positions[i][static_cast<int>(axis)] = value;
    }
  }
  return positions;
}

std::vector<std::uint32_t> GltfAccessors::indices(const GltfValue& number,
                                                  std::size_t vertices) const {
  const GltfValue source = accessor(number);
  const GltfValue type = source.member("type");
  if (type.text("\"SCALAR\"") != "SCALAR") type.refuse("\"SCALAR\"");
  const std::size_t width = index_bytes(source.member("componentType"));
  const std::string all = packed(source, width);
  std::vector<std::uint32_t> corners(all.size() / width);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = little_endian(all, i * width, width);
    if (corners[i] < vertices) continue;
    throw GltfRefused{source.place(),
                      "numbers of vertices from 0 to " + std::to_string(vertices - 1),
                      std::to_string(corners[i]) + " as number " + std::to_string(i)};
  }
  return corners;
}

using Matrix = glm::dmat4;
using Triangle = std::array<std::uint32_t, 3>;

constexpr int kMostNested = 100;  // nodes within nodes
// Vertices, and triangles, of all nodes: a file may use a mesh again and again, but must not need
// memory out of proportion to its size. Data that are named once give fewer than one for each byte.
constexpr std::size_t kAlwaysRead = 1U << 17U;
constexpr std::size_t kLongestName = 256;  // bytes; every primitive is named after its node
constexpr double kUnitError = 1e-3;  // of a quaternion's length, for quaternions of few digits

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

/// The matrix of a rotation [x, y, z, w].
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
      : document_(bytes), most_(std::max(bytes.size(), kAlwaysRead)), data_(document_, 3 * most_) {}

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
  // Without a scene, the roots are the nodes without a parent.
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
    if (reached_[index] != 0) number.refuse("a node with at most one parent, once in the scene");
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
  std::size_t most_;  // vertices, and triangles
  GltfAccessors data_;
  std::vector<char> reached_;  // of each node
  PolygonSoup soup_;
  MeshNames names_;
  double largest_ = 0;  // m, of the coordinates as they stand in the file
};

}  // namespace

// glTF 2.0 (Khronos 2021; .gltf and .glb): triangles of the default scene's nodes, each primitive a
// group. Materials, skins and animations do not describe the solid.

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
  json root = json_or_discarded(bytes);
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
