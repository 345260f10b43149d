#pragma once
// The HTML report.

#include <string>

#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

// The percent reductions at the top of a report.

/// Appends a row of cards for each comparison, a card for each shape: reduction, interval, p and
/// the paper's percentage.
void put_reduction_cards(std::string& out, const Analysis& analysis);

/// The analysis as one HTML page (HtmlPage): conclusion, warnings, figures, tables and provenance.
std::string report_html(const Analysis& analysis, const StudyRecord& record);

}  // namespace palpate::analysis
