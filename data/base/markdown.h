#pragma once
// Text from files in Markdown: shown literally, without markup, HTML, links or characters that
// change the direction of reading.

#include <string>
#include <string_view>

namespace palpate {

/// On one line, printable (text.h).
std::string one_line(std::string_view text);
/// Escaped within a line.
std::string as_markdown(std::string_view text);
/// The same at the beginning of a paragraph, where more characters are markup.
std::string as_paragraph(std::string_view text);

}  // namespace palpate
