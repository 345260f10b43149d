// Printable text never moves the cursor, colours a line or reverses direction. It is UTF-8; making
// it printable twice changes nothing.

#include <cstdlib>
#include <string>

#include "data/base/text.h"

namespace {

/// Well-formed UTF-8 without C0, DEL, C1 and the characters that turn the direction of writing.
void require_harmless(const std::string& text, bool lines) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const int more = byte < 0x80       ? 0
                     : byte >> 5 == 6  ? 1
                     : byte >> 4 == 14 ? 2
                     : byte >> 3 == 30 ? 3
                                       : -1;
    if (more < 0 || i + static_cast<std::size_t>(more) >= text.size()) std::abort();
    unsigned point = more == 0 ? byte : byte & (0x3FU >> more);
    for (int k = 1; k <= more; ++k) {
      const auto next = static_cast<unsigned char>(text[i + static_cast<std::size_t>(k)]);
      if (next >> 6 != 2) std::abort();
      point = point << 6 | (next & 0x3FU);
    }
    const bool control = point < 0x20 || (point >= 0x7F && point < 0xA0);
    const bool turns = point == 0x61C || point == 0x200E || point == 0x200F ||
                       (point >= 0x202A && point <= 0x202E) || (point >= 0x2066 && point <= 0x2069);
    if (turns || (control && !(lines && point == '\n'))) std::abort();
    i += 1 + static_cast<std::size_t>(more);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::string once = palpate::printable(text);
  require_harmless(once, false);
  if (palpate::printable(once) != once) std::abort();
  require_harmless(palpate::printable_lines(text), true);
  if (palpate::printable(text, 40).size() > 40 + 3) std::abort();
  require_harmless(palpate::printable(text, 40), false);
  return 0;
}
