#pragma once
// Participant codes that are easily mistaken for each other.

#include <string>
#include <vector>

namespace palpate::runner::session {

/// The codes of `known` that `code` may stand for: spelt otherwise (P01, p01, P1, PO1), or one
/// letter away (PP01, SUJB01). Codes that differ only by digits are different participants: P01,
/// P02.
std::vector<std::string> near_codes(const std::string& code, const std::vector<std::string>& known);

}  // namespace palpate::runner::session
