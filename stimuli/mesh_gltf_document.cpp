#include "stimuli/mesh_gltf_document.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "data/base/json_text.h"
#include "stimuli/little_endian.h"
#include "stimuli/printable.h"

namespace palpate::stimuli {
namespace {

using nlohmann::json;

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kFileHeader = 12, kChunkFileHeader = 8;

std::string byte_place(std::size_t at) { return "byte " + std::to_string(at); }

// At most so much of what was found is shown.
constexpr std::size_t kShownBytes = 60;

std::string found_text(const json* value) {
  if (value == nullptr) return "nothing";
  if (value->is_object()) return "an object";
  if (value->is_array()) return "a list of " + std::to_string(value->size());
  return printable(value->dump(), kShownBytes);
}

json parsed(std::string_view text) {
  try {
    return data::read_json(text);
  } catch (const data::JsonError& error) {
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

}  // namespace

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
  refuse(count == 0 ? named + ", of which there are none"
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
  if (extensions.size() > 0)
    extensions.element(0).refuse("a file that needs no extension (export without compression)");
}

GltfValue GltfDocument::named_by(const GltfValue& number, const char* list_name,
                                 const char* kind) const {
  const GltfValue all = list(list_name);
  return all.element(number.number_of(kind, all.size()));
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

}  // namespace palpate::stimuli
