#pragma once
// A JSON text with what its own reader drops: the line of every value, and keys given twice.

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/parse.h"

namespace palpate {

/// What is wrong with one file, in the order in which it is found.
class FaultList {
 public:
  explicit FaultList(std::string file) : file_(std::move(file)) {}

  /// pointer: JSON pointer of the value, or of where a missing one should be.
  void add(const std::string& pointer, const std::string& expected);
  void add_syntax_error(int line, int column, const std::string& expected);
  void set_line(const std::string& pointer, int line) { lines_[pointer] = line; }

  bool empty() const { return faults_.empty(); }
  const std::string& file() const { return file_; }
  /// \throws InputError unless the list is empty.
  void throw_if_any() const;

 private:
  int line_of(std::string pointer) const;

  std::string file_;
  std::map<std::string, int> lines_;  // by JSON pointer
  std::vector<Fault> faults_;
};

/// The pointer of a member or element, with ~ and / escaped (RFC 6901).
std::string child_pointer(const std::string& parent, const std::string& key);
std::string child_pointer(const std::string& parent, std::size_t index);

/// Reads JSON (RFC 8259, UTF-8). Keys given twice become faults. \throws InputError with line and
/// column where the text is no JSON, or is nested too deeply.
nlohmann::json read_json(const std::string& text, FaultList& faults);

/// The bytes of a file. \throws InputError where it cannot be read or is beyond all reason large.
std::string read_text_file(const std::string& path);

}  // namespace palpate
