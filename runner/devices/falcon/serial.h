#pragma once
// Serial numbers come from the device, so they are untrusted text that is printed, stored and
// compared with files.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace palpate::runner::devices::falcon {

inline constexpr std::size_t kMaxSerial = 32;  ///< characters

/// Keeps letters, digits, '.', '_' and '-', replaces others by '_', truncates to kMaxSerial.
/// \return "": only blanks and zeros
inline std::string clean_serial(std::span<const std::uint8_t> text) {
  std::string clean;
  bool any = false;
  for (const std::uint8_t byte : text.first(std::min(text.size(), kMaxSerial))) {
    if (byte == 0) break;
    const bool plain = (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z') ||
                       (byte >= 'a' && byte <= 'z') || byte == '.' || byte == '_' || byte == '-';
    any = any || byte != ' ';
    clean += plain ? static_cast<char>(byte) : '_';
  }
  return any ? clean : "";
}

}  // namespace palpate::runner::devices::falcon
