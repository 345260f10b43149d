#include "data/base/checksum.h"

#include <nettle/sha2.h>

namespace palpate {

Checksum checksum(const void* bytes, std::size_t size) {
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, size, static_cast<const unsigned char*>(bytes));
  Checksum sum;
  sha256_digest(&context, sum.size(), sum.data());
  return sum;
}

std::string to_hex(const Checksum& sum) {
  std::string hex;
  for (const unsigned char byte : sum) {
    for (const int shift : {4, 0}) hex += "0123456789abcdef"[byte >> shift & 0xf];
  }
  return hex;
}

std::string checksum_hex(std::string_view bytes) {
  return to_hex(checksum(bytes.data(), bytes.size()));
}

bool is_checksum(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == text.npos;
}

}  // namespace palpate
