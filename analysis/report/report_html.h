#pragma once

#include <string>

#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis as one HTML page (HtmlPage): the answer, figures, tables, and where all comes from.
std::string report_html(const Analysis& analysis, const ReportRecord& record);

}  // namespace palpate::analysis
