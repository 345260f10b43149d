#pragma once
// A glTF document: its JSON, of which every value knows its place, and the data of a .glb.

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace palpate::stimuli {

/// What reading gives up with.
struct GltfRefused {
  std::string place;  ///< a JSON pointer, a line or a byte; empty: the file
  std::string expected, found;
};

/// A value of the document, or none, and its place. All that is read of it is checked:
/// GltfRefused says what was expected there and what was found.
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
  double number_or(double otherwise) const { return present() ? number() : otherwise; }
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
  /// What a value names by its number. \param kind  of the list's entries, "mesh"
  GltfValue named_by(const GltfValue& number, const char* list_name, const char* kind) const;
  /// The data chunk of a .glb.
  const std::optional<std::string_view>& binary() const { return binary_; }

 private:
  std::string_view take_chunks(std::string_view bytes);

  std::optional<std::string_view> binary_;
  nlohmann::json root_;
};

}  // namespace palpate::stimuli
