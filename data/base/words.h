#pragma once
// Words of messages and names.

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// The letters A to Z in lower case; all other characters as they are.
std::string lower_case(std::string_view text);

/// "a, b, c".
std::string listed(const std::vector<std::string>& words);

}  // namespace palpate
