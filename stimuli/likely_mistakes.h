#pragma once
// What is probably meant by input that cannot be read.

#include <string>
#include <string_view>

namespace palpate::stimuli {

/// Whether a text is in UTF-16, as some editors and exporters save it, with or without the mark at
/// its beginning.
bool is_utf16(std::string_view bytes);

/// "; decimals follow a point: 0.5" for a number with a decimal comma; "" for other words.
std::string point_meant(std::string_view word);

}  // namespace palpate::stimuli
