#pragma once
// RFC 4180 in a stream: constant memory, fields as views into one buffer.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "stimuli/input_file.h"

namespace palpate::analysis {

/// Reads records one after the other. Tolerates a byte order mark, LF or CRLF, a missing last
/// newline and empty lines; quoted fields may hold commas, quotes and newlines.
class CsvReader {
 public:
  /// A record may have at most so many bytes: a forgotten quote shall not swallow the file.
  static constexpr std::size_t kMaxRecord = std::size_t{1} << 20;
  static constexpr std::uintmax_t kMaxFile = std::uintmax_t{1} << 32;

  /// \throws std::runtime_error where the file cannot be opened.
  explicit CsvReader(const std::string& path);

  /// Steps to the next record; false at the end, or where nothing after a fault can be trusted.
  bool next();
  /// Views of the record's fields, good until next(). Meaningless where fault() is not empty.
  const std::vector<std::string_view>& fields() const { return fields_; }
  /// What is wrong with the record as CSV; empty: nothing. Also to be read once after the last
  /// next(), for a file that breaks off.
  const std::string& fault() const { return fault_; }
  /// The line, from 1, on which the record starts.
  std::size_t line() const { return line_; }

 private:
  enum class Quoted { complete, incomplete };

  bool fill();
  void split_plain(std::string_view text);
  Quoted split_quoted();
  bool end_with(std::string fault);

  std::unique_ptr<stimuli::InputFile> file_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< unread bytes of buffer_
  bool at_end_ = false, stopped_ = false;
  std::vector<std::string_view> fields_;
  std::string unquoted_;         ///< holds the text of quoted fields, the quotes taken off
  std::string fault_, trouble_;  ///< trouble_: reading failed
  std::size_t line_ = 0, next_line_ = 1;
};

}  // namespace palpate::analysis
