#pragma once
// The HTML report.

#include <string>

#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis as one HTML page (HtmlPage): conclusion, warnings, figures, tables and provenance.
std::string report_html(const Analysis& analysis, const StudyRecord& record);

}  // namespace palpate::analysis
