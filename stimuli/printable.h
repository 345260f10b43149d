#pragma once
// Text made safe for a terminal. Nothing that came from a file, a device or the command line is
// printed raw: control sequences could move the cursor, hide other text or answer for the user.

#include <cstddef>
#include <string>
#include <string_view>

namespace palpate::stimuli {

/// Whether all is well-formed UTF-8 that is shown unchanged: no control characters (C0, DEL,
/// C1), nothing that turns the direction of what follows, no separators of lines, no
/// noncharacters.
bool is_plain_utf8(std::string_view text);

/// Escapes whatever is not plain: "\u001b" for a character, "\xff" for a byte that is not UTF-8.
/// Idempotent.
std::string printable(std::string_view text);

/// The same, at most `max_bytes` of it, cut between characters with an ellipsis.
std::string printable(std::string_view text, std::size_t max_bytes);

/// The same for a text of several lines: line feeds stay.
std::string printable_lines(std::string_view text);

}  // namespace palpate::stimuli
