#pragma once
// Text of messages: similar words, safe printing, hints for input that cannot be read. Never print
// text from a file, a device or the command line raw: control sequences could move the cursor, hide
// other text or answer for the user.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/utf8.h"

namespace palpate {

/// Levenshtein distance: number of bytes to insert, delete or replace to turn `a` into `b`.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// For "did you mean ...?": the first of the known words nearest to `word`; "": even that one
/// differs too much.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

/// Whether a text is well-formed UTF-8 that a terminal shows unchanged: no control characters (C0,
/// DEL, C1), no changes of direction, no line separators, no noncharacters.
bool is_plain_utf8(std::string_view text);

/// Escapes all other characters as "\u001b", and bytes that are not UTF-8 as "\xff". Idempotent.
std::string printable(std::string_view text);

/// The same, at most `max_bytes` of it, cut between characters with an ellipsis.
std::string printable(std::string_view text, std::size_t max_bytes);

/// The same for a text of several lines: line feeds stay.
std::string printable_lines(std::string_view text);

/// Whether a text is in UTF-16, as some editors and exporters save it, with or without the mark at
/// its beginning.
bool is_utf16(std::string_view bytes);

/// "; decimals follow a point: 0.5" for a number with a decimal comma; "" for other words.
std::string point_meant(std::string_view word);

}  // namespace palpate
