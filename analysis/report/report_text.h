#pragma once
// The text report.

#include <string>

#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis for a terminal: the conclusion, then warnings and tables. UTF-8, at most 100
/// columns; long names are shortened, wide tables are split.
std::string report_text(const Analysis& analysis);

/// One of its tables, and a paragraph.
std::string table_text(const Table& table);
std::string paragraph_text(const std::string& text);

}  // namespace palpate::analysis
