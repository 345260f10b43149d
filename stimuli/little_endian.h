#pragma once
// Numbers in binary files.

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace palpate::stimuli {

/// The unsigned number of `size` (1 to 4) bytes, the lowest first, at byte `at`, which must be
/// there.
inline std::uint32_t little_endian(std::string_view bytes, std::size_t at, std::size_t size = 4) {
  std::uint32_t word = 0;
  for (std::size_t i = size; i-- > 0;)
    word = word << 8U | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

}  // namespace palpate::stimuli
