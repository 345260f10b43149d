#pragma once
// Streaming reader of CSV (RFC 4180). Uses constant memory; fields are views into one buffer.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/input_file.h"

namespace palpate::analysis {

/// An unknown column of a table, and the missing one that is probably meant: "Level", "level".
struct AlikeColumn {
  std::string found, meant;
};

/// Finds columns with the same letters and digits, ignoring case and separators, or within one edit
/// for names of up to five letters, two for longer ones. \param found, known names; each known one
/// is used once
std::vector<AlikeColumn> alike_columns(const std::vector<std::string>& found,
                                       const std::vector<std::string_view>& known);

/// "Column 'Level' is not known and was not read: 'level' is."
std::string sentence(const AlikeColumn& column);
/// "", or " (is 'Level' meant?)": a hint for a missing column.
std::string hint_for(std::string_view missing, const std::vector<AlikeColumn>& alike);

/// Reads records one after the other. Tolerates a byte order mark, LF or CRLF, a missing last
/// newline and empty lines; quoted fields may hold commas, quotes and newlines.
class CsvReader {
 public:
  /// bytes; a larger record is a fault, such as after an unclosed quote.
  static constexpr std::size_t kMaxRecord = std::size_t{1} << 20;
  /// bytes
  static constexpr std::uintmax_t kMaxFile = std::uintmax_t{1} << 32;

  /// \throws std::runtime_error: the file cannot be opened.
  explicit CsvReader(const std::string& path);

  /// Reads the next record; false at the end of the file or after a fault from which it cannot
  /// recover.
  bool next();
  /// The record's fields, valid until next(); unspecified if fault() is not empty.
  const std::vector<std::string_view>& fields() const { return fields_; }
  /// The fault of the record as CSV; empty: none. Check it also after next() returned false: the
  /// file may be truncated.
  const std::string& fault() const { return fault_; }
  /// The line, from 1, on which the record starts.
  std::size_t line() const { return line_; }

 private:
  enum class Quoted { complete, incomplete };

  bool fill();
  void split_plain(std::string_view text);
  Quoted split_quoted();
  bool end_with(std::string fault);

  std::unique_ptr<InputFile> file_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< unread bytes of buffer_
  bool at_end_ = false, stopped_ = false;
  std::vector<std::string_view> fields_;
  std::string unquoted_;  ///< text of the fields of a record with quotes, without the quotes
  std::string fault_, read_error_;  ///< read_error_: reason why reading failed
  std::size_t line_ = 0, next_line_ = 1;
};

}  // namespace palpate::analysis
