#include "data/base/text.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "data/base/utf8.h"

namespace palpate {
namespace {

bool is_plain(const Character& c) {
  const auto within = [&](std::uint32_t least, std::uint32_t most) {
    return c.code >= least && c.code <= most;
  };
  if (!c.well_formed || c.code < 0x20 || within(0x7F, 0x9F)) return false;
  // Marks, embeddings, overrides and isolates of direction (Unicode 15, 23.2).
  if (c.code == 0x61C || within(0x200E, 0x200F) || within(0x202A, 0x202E) || within(0x2066, 0x2069))
    return false;
  if (within(0x2028, 0x2029)) return false;                      // separators of lines
  if (c.code == 0xFEFF || within(0xFFF9, 0xFFFB)) return false;  // byte order mark, annotations
  if (within(0xE0000, 0xE007F)) return false;                    // tags: invisible text
  return (c.code & 0xFFFE) != 0xFFFE && !within(0xFDD0, 0xFDEF);
}

void append(const Character& c, std::string_view bytes, std::string& out) {
  if (is_plain(c)) {
    out += bytes;
    return;
  }
  std::array<char, 16> text{};
  const char* const form = !c.well_formed ? "\\x%02x" : c.code > 0xFFFF ? "\\U%08x" : "\\u%04x";
  const unsigned value = c.well_formed ? c.code : static_cast<std::uint8_t>(bytes[0]);
  std::snprintf(text.data(), text.size(), form, value);
  out += text.data();
}

std::string shown(std::string_view text, std::size_t max_bytes, bool lines) {
  std::string out;
  while (!text.empty()) {
    const Character c = first_character(text);
    const std::size_t before = out.size();
    if (lines && c.code == '\n' && c.well_formed) {
      out += '\n';
    } else {
      append(c, text.substr(0, c.size), out);
    }
    if (out.size() > max_bytes) {
      out.resize(before);
      return out + "…";
    }
    text.remove_prefix(c.size);
  }
  return out;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);  // to the first j bytes of b
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
  std::string begun;
  int begun_words = 0;
  for (const std::string& one : known) {
    if (word.size() < 2 || !one.starts_with(word)) continue;
    begun = one;
    ++begun_words;
  }
  if (begun_words == 1) return begun;
  std::string nearest;
  std::size_t distance = word.size() / 2 + 1;
  for (const std::string& one : known) {
    const std::size_t edits = edit_distance(word, one);
    if (edits >= distance) continue;
    distance = edits;
    nearest = one;
  }
  return nearest;
}

bool is_plain_utf8(std::string_view text) {
  while (!text.empty()) {
    const Character c = first_character(text);
    if (!is_plain(c)) return false;
    text.remove_prefix(c.size);
  }
  return true;
}

std::string printable(std::string_view text) { return shown(text, std::string::npos, false); }

std::string printable(std::string_view text, std::size_t max_bytes) {
  return shown(text, max_bytes, false);
}

std::string printable_lines(std::string_view text) { return shown(text, std::string::npos, true); }

bool is_utf16(std::string_view bytes) {
  constexpr std::size_t kEnough = 4;  // bytes: two letters
  if (bytes.size() < kEnough) return false;
  const bool marked = bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF");
  if (marked) bytes.remove_prefix(2);
  const auto letter = [&](std::size_t first, std::size_t second) {
    const auto c = static_cast<unsigned char>(bytes[first]);
    return bytes[second] == '\0' && ((c >= ' ' && c < 0x7F) || (c >= '\t' && c <= '\r'));
  };
  if (bytes.size() < kEnough) return marked;
  return (letter(0, 1) && letter(2, 3)) || (letter(1, 0) && letter(3, 2));
}

std::string point_meant(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  const std::size_t comma = word.find(',');
  if (comma == std::string_view::npos || word.size() > kLongest) return "";
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::string_view whole = word.substr(0, comma);
  if (whole.starts_with('-') || whole.starts_with('+')) whole.remove_prefix(1);
  const std::string_view decimals = word.substr(comma + 1, word.find_first_of("eE") - comma - 1);
  const auto all_digits = [&](std::string_view part) {
    return !part.empty() && std::all_of(part.begin(), part.end(), digit);
  };
  if (!all_digits(whole) || !all_digits(decimals)) return "";
  std::string meant(word);
  meant[comma] = '.';
  return "; decimals follow a point: " + meant;
}

}  // namespace palpate
