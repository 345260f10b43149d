#pragma once
// Checksum that identifies texts.

#include <string>
#include <string_view>

namespace palpate::protocols {

/// SHA-256 (FIPS 180-4) of the bytes, as 64 lower-case hexadecimal digits. Implemented
/// here because nothing else needs a cryptographic library.
std::string sha256_hex(std::string_view bytes);

}  // namespace palpate::protocols
