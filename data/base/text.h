#pragma once
// Text: base64, UTF-8, similar words, safe printing, hints for unreadable input.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Base64 (RFC 4648, section 4).
std::string base64_encoded(std::string_view bytes);

/// Nothing if the text is not base64. Padding may be missing.
std::optional<std::string> base64_decoded(std::string_view text);

// Characters in UTF-8 (RFC 3629).

struct Character {
  std::uint32_t code = 0;
  std::size_t size = 1;  ///< bytes
  bool well_formed = false;
};

/// \pre  text is not empty
Character first_character(std::string_view text);

/// Size in bytes of a character that begins with this byte; 0: none can.
std::size_t utf8_size(char lead);

/// Whether a byte continues a character.
constexpr bool continues_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

std::size_t count_characters(std::string_view text);
void remove_last_character(std::string& text);
std::string utf8(std::uint32_t code);

// Similarity of words, for "did you mean ...?".

/// Levenshtein distance: number of bytes to insert, delete or replace to turn `a` into `b`.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The first of the known words nearest to `word`; "": even that one differs too much.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

// Safe text for a terminal. Never print text from a file, a device or the command line raw: control
// sequences could move the cursor, hide other text or answer for the user.

/// Whether a text is well-formed UTF-8 that a terminal shows unchanged: no control characters (C0,
/// DEL, C1), no changes of direction, no line separators, no noncharacters.
bool is_plain_utf8(std::string_view text);

/// Escapes all other characters as "\u001b", and bytes that are not UTF-8 as "\xff". Idempotent.
std::string printable(std::string_view text);

/// The same, at most `max_bytes` of it, cut between characters with an ellipsis.
std::string printable(std::string_view text, std::size_t max_bytes);

/// The same for a text of several lines: line feeds stay.
std::string printable_lines(std::string_view text);

// Hints for input that cannot be read.

/// Whether a text is in UTF-16, as some editors and exporters save it, with or without the mark at
/// its beginning.
bool is_utf16(std::string_view bytes);

/// "; decimals follow a point: 0.5" for a number with a decimal comma; "" for other words.
std::string point_meant(std::string_view word);

}  // namespace palpate
