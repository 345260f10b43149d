#pragma once
// Bytes in text (RFC 4648, section 4).

#include <optional>
#include <string>
#include <string_view>

namespace palpate::stimuli {

std::string base64_encoded(std::string_view bytes);

/// Nothing where the text is no base64. Padding may be missing.
std::optional<std::string> base64_decoded(std::string_view text);

}  // namespace palpate::stimuli
