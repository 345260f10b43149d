#pragma once
// Base64 (RFC 4648, section 4).

#include <optional>
#include <string>
#include <string_view>

namespace palpate {

std::string base64_encoded(std::string_view bytes);

/// Nothing if the text is not base64. Padding may be missing.
std::optional<std::string> base64_decoded(std::string_view text);

}  // namespace palpate
