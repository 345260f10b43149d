#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate::runner::falcon {

/// A firmware file named by the user; none is shipped. A stream for the boot ROM of TI's C28x
/// processors: 16-bit little-endian words; key 0x08AA, 8 reserved words, entry point; blocks of a
/// count, a destination and so many words; a count of 0 ends it.
struct FirmwareImage {
  std::vector<std::uint8_t> bytes;
  std::uint32_t entry = 0;
  int blocks = 0;
};

/// Checks the structure; the format has no checksum. \throws InputError naming `file` and the byte.
FirmwareImage parse_image(std::vector<std::uint8_t> bytes, const std::string& file);
/// \throws InputError.
FirmwareImage read_image(const std::string& file);

}  // namespace palpate::runner::falcon
