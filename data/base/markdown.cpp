#include "data/base/markdown.h"

#include <algorithm>
#include <cstddef>

#include "data/base/text.h"

namespace palpate {

std::string one_line(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return printable(out);
}

std::string as_markdown(std::string_view text) {
  constexpr std::string_view kMarks = "\\`*_[]<>&|~$";
  const std::string line = one_line(text);
  std::string out;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool link = c == ':' && line.compare(i, 3, "://") == 0;
    if (kMarks.find(c) != std::string_view::npos || link) out += '\\';
    out += c;
  }
  return out;
}

std::string as_paragraph(std::string_view text) {
  std::string out = as_markdown(text);
  out.erase(0, std::min(out.find_first_not_of(' '), out.size()));
  // "# " would begin a heading, "1. " and "- " a list.
  const std::size_t digits = std::min(out.find_first_not_of("0123456789"), out.size());
  const bool numbered =
      digits > 0 && digits < out.size() && (out[digits] == '.' || out[digits] == ')');
  if (numbered) out.insert(digits, "\\");
  if (!out.empty() && std::string_view("#+-=").find(out[0]) != std::string_view::npos)
    out.insert(0, "\\");
  return out;
}

}  // namespace palpate
