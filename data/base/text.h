#pragma once
// Text: bytes in it, words that are alike, what is safe to print, what was probably meant.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Bytes in text (RFC 4648, section 4).
std::string base64_encoded(std::string_view bytes);

/// Nothing where the text is no base64. Padding may be missing.
std::optional<std::string> base64_decoded(std::string_view text);

// Characters in UTF-8 (RFC 3629).

struct Character {
  std::uint32_t code = 0;
  std::size_t size = 1;  ///< bytes
  bool well_formed = false;
};

/// \pre  text is not empty
Character first_character(std::string_view text);

/// Bytes of the character that begins with this byte; 0: none does.
std::size_t utf8_size(char lead);

/// Whether a byte is not the first of its character.
constexpr bool continues_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

std::size_t count_characters(std::string_view text);
void remove_last_character(std::string& text);
std::string utf8(std::uint32_t code);

// How alike two words are: for "did you mean ...?".

/// Levenshtein's distance: how many bytes to insert, delete or replace to make `b` of `a`.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The first of the words that are most like another; "": with so many edits it is another word.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

// Text made safe for a terminal. Nothing that came from a file, a device or the command line is
// printed raw: control sequences could move the cursor, hide other text or answer for the user.

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

// What is probably meant by input that cannot be read.

/// Whether a text is in UTF-16, as some editors and exporters save it, with or without the mark at
/// its beginning.
bool is_utf16(std::string_view bytes);

/// "; decimals follow a point: 0.5" for a number with a decimal comma; "" for other words.
std::string point_meant(std::string_view word);

}  // namespace palpate
