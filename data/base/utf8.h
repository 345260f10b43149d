#pragma once
// Characters in UTF-8 (RFC 3629).

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace palpate {

/// One character at the beginning of a text.
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

}  // namespace palpate
