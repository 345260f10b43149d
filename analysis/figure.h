#pragma once

#include <string>

#include "analysis/analysis.h"

namespace palpate {

/// The paper's figure 15 from this data, as a stand-alone SVG: mean times of point and ray per
/// shape with 95 % intervals over participants and a line for each participant; beside it the
/// percent reduction with its interval and the paper's values. The title is the answer.
std::string figure15(const Analysis& analysis);

}  // namespace palpate
