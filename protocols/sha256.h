#pragma once

#include <string>
#include <string_view>

namespace palpate::protocols {

/// SHA-256 (FIPS 180-4) of the bytes, as 64 lower-case hexadecimal digits. Identifies texts; it is
/// small enough to own, and no cryptographic library is needed elsewhere.
std::string sha256_hex(std::string_view bytes);

}  // namespace palpate::protocols
