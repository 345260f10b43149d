#pragma once
// SHA-256 (FIPS 180-4) through nettle: identifies protocols and files, seals rows.

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace palpate {

using Checksum = std::array<unsigned char, 32>;

Checksum checksum(const void* bytes, std::size_t size);
std::string to_hex(const Checksum& checksum);      ///< 64 lower-case digits
std::string checksum_hex(std::string_view bytes);  ///< of bytes
bool is_checksum(std::string_view text);           ///< 64 digits 0-9 and a-f

}  // namespace palpate
