#pragma once
// The report of a study: as text, JSON and HTML.

#include <string>

#include "analysis/input/study_record.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis for a terminal: the conclusion, then warnings and tables. UTF-8, at most 100
/// columns; long names are shortened, wide tables are split.
std::string report_text(const Analysis& analysis);

/// One of its tables, and a paragraph.
std::string table_text(const Table& table);
std::string paragraph_text(const std::string& text);

/// The analysis as JSON; the keys are described in analysis/README.md. Numbers have 17 significant
/// digits; an undefined one is null beside "status": "undefined" and a "reason".
std::string report_json(const Analysis& analysis);

/// Appends the percent reductions at the top of a report: a row of cards for each comparison, a
/// card for each shape: reduction, interval, p and the paper's percentage.
void put_reduction_cards(std::string& out, const Analysis& analysis);

/// The analysis as one HTML page (HtmlPage): conclusion, warnings, figures, tables and provenance.
std::string report_html(const Analysis& analysis, const StudyRecord& record);

}  // namespace palpate::analysis
