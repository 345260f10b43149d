#include "analysis/input/csv_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "data/base/text.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kLongestCompared = 64;  // bytes; longer names are not compared
constexpr std::size_t kMostShown = 40;

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z');
}

/// Letters in lower case and digits.
std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (is_letter_or_digit(c)) out += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

constexpr std::size_t kBlock = std::size_t{1} << 18;
constexpr std::string_view kTooLong =
    "record of more than 1 MiB: expected one row a line (is a quote left open?)";

constexpr std::string_view kBareCr =
    "holds a CR that no LF follows (do lines end in CR alone?): expected lines that end in LF or "
    "CRLF";

const char* find(const char* from, const char* to, char what) {
  return static_cast<const char*>(std::memchr(from, what, static_cast<std::size_t>(to - from)));
}

}  // namespace

std::vector<AlikeColumn> alike_columns(const std::vector<std::string>& found,
                                       const std::vector<std::string_view>& known) {
  std::vector<AlikeColumn> alike;
  for (const std::string& name : found) {
    const std::string own = plain(name);
    if (own.empty() || name.size() > kLongestCompared ||
        std::ranges::find(known, name) != known.end())
      continue;
    std::string_view nearest;
    std::size_t least = own.size() <= 5 ? 2 : 3;  // beyond, names count as different
    for (const std::string_view one : known) {
      if (std::ranges::find(found, one) != found.end()) continue;
      const std::size_t distance = edit_distance(own, plain(one));
      if (distance < least) {
        least = distance;
        nearest = one;
      }
    }
    if (!nearest.empty()) alike.push_back({name, std::string(nearest)});
  }
  return alike;
}

std::string sentence(const AlikeColumn& column) {
  return "Column '" + printable(column.found, kMostShown) +
         "' is not known and was not read; is '" + column.meant + "' meant?";
}

std::string hint_for(std::string_view missing, const std::vector<AlikeColumn>& alike) {
  const auto found = std::ranges::find(alike, missing, &AlikeColumn::meant);
  if (found == alike.end()) return "";
  return " (is '" + printable(found->found, kMostShown) + "' meant?)";
}

CsvReader::CsvReader(const std::string& path) : file_(std::make_unique<InputFile>(path, kMaxFile)) {
  buffer_.resize(CsvReader::kMaxRecord + kBlock);
  fill();
  if (end_ >= 3 && std::memcmp(buffer_.data(), "\xEF\xBB\xBF", 3) == 0) begin_ = 3;
}

/// Moves unread bytes to the front and appends more from the file; false at its end.
bool CsvReader::fill() {
  if (at_end_) return false;
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  std::size_t got = 0;
  try {
    got = file_->read(buffer_.data() + end_, std::min(kBlock, buffer_.size() - end_));
  } catch (const std::runtime_error& error) {
    read_error_ = error.what();
  }
  end_ += got;
  if (got == 0) at_end_ = true;
  return got > 0;
}

bool CsvReader::end_with(std::string fault) {
  fault_ = std::move(fault);
  stopped_ = true;
  return false;
}

bool CsvReader::next() {
  fault_.clear();
  if (stopped_) return false;
  std::size_t seen = 0;  // bytes of the record already searched for a newline
  for (;;) {
    const char* const first = buffer_.data() + begin_;
    const char* const last = buffer_.data() + end_;
    const char* newline = find(first + seen, last, '\n');
    if (!newline) {
      if (end_ - begin_ > kMaxRecord) {
        line_ = next_line_;
        return end_with(std::string(find(first, last, '\r') ? kBareCr : kTooLong));
      }
      seen = end_ - begin_;
      if (fill()) continue;
      if (!read_error_.empty()) return end_with("cannot be read: " + read_error_);
      if (begin_ == end_) return false;
      newline = buffer_.data() + end_;
    }
    const char* const start = buffer_.data() + begin_;
    line_ = next_line_;
    if (find(start, newline, '"')) {
      fault_.clear();
      if (split_quoted() == Quoted::complete) return true;
      if (end_ - begin_ > kMaxRecord) return end_with(std::string(kTooLong));
      seen = end_ - begin_;
      if (fill()) {
        seen = 0;
        continue;
      }
      if (!read_error_.empty()) return end_with("cannot be read: " + read_error_);
      return end_with("a quote is opened in this record and never closed");
    }
    std::string_view text(start, static_cast<std::size_t>(newline - start));
    if (text.size() > kMaxRecord) return end_with(std::string(kTooLong));
    begin_ = std::min(begin_ + text.size() + 1, end_);
    ++next_line_;
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    seen = 0;
    if (text.empty()) continue;
    split_plain(text);
    return true;
  }
}

void CsvReader::split_plain(std::string_view text) {
  fields_.clear();
  const char* from = text.data();
  const char* const to = from + text.size();
  if (find(from, to, '\0')) {
    fault_ = "holds a NUL byte: expected UTF-8 text (UTF-16 is not read)";
    return;
  }
  if (find(from, to, '\r')) {
    fault_ = kBareCr;
    return;
  }
  while (const char* comma = find(from, to, ',')) {
    fields_.emplace_back(from, static_cast<std::size_t>(comma - from));
    from = comma + 1;
  }
  fields_.emplace_back(from, static_cast<std::size_t>(to - from));
}

/// Splits a record with quotes that begins at begin_; incomplete: it continues beyond the buffer.
CsvReader::Quoted CsvReader::split_quoted() {
  const std::string_view text(buffer_.data() + begin_, end_ - begin_);
  std::vector<std::pair<std::size_t, std::size_t>>
      spans;  // offsets into unquoted_, which may be reallocated
  unquoted_.clear();
  std::size_t at = 0, lines = 1, field = 0;
  bool done = false;
  while (!done) {
    bool quoted = at < text.size() && text[at] == '"';
    if (quoted) {
      for (++at;; ++at) {
        if (at >= text.size()) return Quoted::incomplete;
        if (text[at] == '"') {
          if (at + 1 < text.size() && text[at + 1] == '"') {
            ++at;
          } else {
            ++at;
            break;
          }
        }
        lines += text[at] == '\n';
        unquoted_ += text[at];
      }
    }
    const std::size_t rest = at;
    while (at < text.size() && text[at] != ',' && text[at] != '\n') ++at;
    if (at == text.size() && !at_end_) return Quoted::incomplete;
    std::string_view plain = text.substr(rest, at - rest);
    done = at == text.size() || text[at] == '\n';
    if (done && !plain.empty() && plain.back() == '\r') plain.remove_suffix(1);
    if (fault_.empty() && plain.find('\r') != std::string_view::npos) {
      fault_ = kBareCr;
    } else if (fault_.empty() && quoted && !plain.empty()) {
      fault_ = "field " + std::to_string(spans.size() + 1) +
               ": expected a comma or the end of the line after the closing quote";
    } else if (fault_.empty() && plain.find('"') != std::string_view::npos) {
      fault_ = "field " + std::to_string(spans.size() + 1) +
               ": a quote inside a field: expected the whole field in quotes, with \"\" for each";
    }
    unquoted_ += plain;
    spans.emplace_back(field, unquoted_.size() - field);
    field = unquoted_.size();
    if (at < text.size()) ++at;
  }
  if (fault_.empty() && unquoted_.find('\0') != std::string::npos) {
    fault_ = "holds a NUL byte: expected UTF-8 text (UTF-16 is not read)";
  }
  fields_.clear();
  for (const auto& [start, size] : spans) {
    fields_.push_back(std::string_view(unquoted_).substr(start, size));
  }
  begin_ += at;
  next_line_ += lines;
  return Quoted::complete;
}

}  // namespace palpate::analysis
