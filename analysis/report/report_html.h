#pragma once

#include <string>

#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis as one HTML page that is complete in itself: its content security policy allows no
/// network and no script but its own, every text is escaped. Figures are drawn by Vega where the
/// program was built with it, and are there as SVG for where scripts do not run and for saving.
std::string report_html(const Analysis& analysis, const ReportRecord& record);

}  // namespace palpate::analysis
