#include "stimuli/likely_mistakes.h"

#include <algorithm>

namespace palpate::stimuli {

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

}  // namespace palpate::stimuli
