#include "stimuli/printable.h"

#include <array>
#include <cstdint>
#include <cstdio>

namespace palpate::stimuli {
namespace {

struct Character {
  std::uint32_t code = 0;
  std::size_t size = 1;  // bytes
  bool well_formed = false;
};

/// The character at the start of a text that is not empty (RFC 3629).
Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint32_t lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const std::size_t size = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC2 ? 2 : 0;
  if (size == 0 || lead > 0xF4 || text.size() < size) return {};
  std::uint32_t code = lead & (0xFFU >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (overlong || surrogate || code > 0x10FFFF) return {};
  return {code, size, true};
}

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
  if (within(0xE0000, 0xE007F)) return false;                    // tags: text that nobody sees
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
    const Character c = first_of(text);
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

bool is_plain_utf8(std::string_view text) {
  while (!text.empty()) {
    const Character c = first_of(text);
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

}  // namespace palpate::stimuli
