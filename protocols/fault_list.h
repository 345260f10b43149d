#pragma once
// The faults of a JSON file, and the pointers (RFC 6901) that name their places.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "protocols/parse.h"

namespace palpate::protocols {

/// Hash of a JSON pointer: FNV-1a of its characters, continued from that of its parent. A collision
/// would at worst show the wrong line in a message.
class PointerHash {
 public:
  PointerHash() = default;
  explicit PointerHash(std::string_view pointer) { add(pointer); }
  /// Of a member or element.
  PointerHash child(std::string_view token) const;
  std::uint64_t value() const { return value_; }

 private:
  void add(std::string_view characters);
  std::uint64_t value_ = 14695981039346656037U;
};

/// The faults of one file in the order found: the first ones in full, the rest as a count.
class FaultList {
 public:
  explicit FaultList(std::string file) : file_(std::move(file)) {}

  /// pointer: JSON pointer of the value, or of where a missing one should be.
  void add(const std::string& pointer, const std::string& expected);
  void add_syntax_error(int line, int column, const std::string& expected);
  void set_line(PointerHash pointer, int line) { lines_[pointer.value()] = line; }

  bool empty() const { return faults_.empty(); }
  /// The number so far; compare later to see whether faults were added.
  std::size_t count() const { return faults_.size() + unlisted_; }
  /// Whether further faults are only counted: then their texts need not be made.
  bool full() const { return faults_.size() >= kMostListed; }
  const std::string& file() const { return file_; }
  /// \throws InputError unless the list is empty.
  void throw_if_any() const;

 private:
  static constexpr std::size_t kMostListed = 1000;

  int line_of(std::string_view pointer) const;

  std::string file_;
  std::unordered_map<std::uint64_t, int> lines_;  // by PointerHash
  std::vector<Fault> faults_;
  std::size_t unlisted_ = 0;
};

/// The pointer of a member or element, with ~ and / escaped (RFC 6901).
std::string child_pointer(const std::string& parent, const std::string& key);
std::string child_pointer(const std::string& parent, std::size_t index);

}  // namespace palpate::protocols
