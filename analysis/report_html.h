#pragma once

#include <string>

#include "analysis/analysis.h"

namespace palpate {

/// The analysis as one HTML page with the figure inside: no scripts, nothing from the network, fit
/// for dark screens and for paper.
std::string report_html(const Analysis& analysis);

}  // namespace palpate
