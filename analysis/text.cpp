#include "analysis/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include "data/base/text.h"
#include "data/base/utf8.h"

namespace palpate::analysis {

namespace {

std::size_t bytes_of(std::string_view text, std::size_t characters) {
  std::size_t at = 0;
  while (at < text.size() && characters-- > 0) {
    ++at;
    while (at < text.size() && continues_character(text[at])) ++at;
  }
  return at;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : printable(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::size_t width(std::string_view text) { return count_characters(text); }

std::string pad_right(std::string_view text, std::size_t columns) {
  std::string out(text);
  const std::size_t used = width(text);
  if (used < columns) out.append(columns - used, ' ');
  return out;
}

std::string pad_left(std::string_view text, std::size_t columns) {
  const std::size_t used = width(text);
  return std::string(used < columns ? columns - used : 0, ' ') + std::string(text);
}

std::string shortened(std::string_view text, std::size_t columns) {
  if (width(text) <= columns) return std::string(text);
  return std::string(text.substr(0, bytes_of(text, columns - 1))) + "…";
}

std::vector<std::string> wrapped(std::string_view text,
                                 const std::function<bool(std::string_view)>& fits) {
  std::vector<std::string> lines{""};
  while (!text.empty()) {
    std::size_t end = text.find(' ');
    if (end != std::string_view::npos && text.substr(end + 1).starts_with('%')) {
      end = text.find(' ', end + 1);
    }
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    std::string longer = lines.back();
    if (!longer.empty()) longer += ' ';
    longer += word;
    if (!lines.back().empty() && !fits(longer)) {
      lines.emplace_back(word);
    } else {
      lines.back() = std::move(longer);
    }
  }
  return lines;
}

std::string counted(std::size_t n, std::string_view one, std::string_view many) {
  return std::to_string(n) + " " + std::string(n == 1 ? one : many);
}

std::string fixed(double value, int decimals) {
  char digits[512];  // the largest double has 309 digits before the point
  const auto end = std::to_chars(digits, digits + sizeof digits, std::fabs(value),
                                 std::chars_format::fixed, decimals)
                       .ptr;
  const std::string text(digits, end);
  const bool zero = text.find_first_not_of("0.") == std::string::npos;
  return (std::signbit(value) && !zero ? "−" : "") + text;
}

std::string short_number(double value) {
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char digits[32];
  const auto end =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::general, 4).ptr;
  return {digits, end};
}

std::string p_text(double p) {
  if (p < 0.001) return "<0.001";
  return fixed(p, 3);
}

std::string p_phrase(double p) { return p < 0.001 ? "p < 0.001" : "p = " + p_text(p); }

}  // namespace palpate::analysis
