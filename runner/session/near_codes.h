#pragma once
// Participant codes that are easily taken for each other.

#include <string>
#include <vector>

namespace palpate::runner {

/// Those of `known` that `code` may have been meant to be: written otherwise (P01, p01, P1, PO1),
/// or a letter away (PP01, SUJB01). What differs by digits alone is another participant: P01, P02.
std::vector<std::string> near_codes(const std::string& code, const std::vector<std::string>& known);

}  // namespace palpate::runner
