#pragma once

#include <string>

#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {

/// The analysis of the tasks of a study of version 2, for a terminal.
std::string task_report_text(const TaskAnalysis& analysis);
/// The same as an HTML page with the figures.
std::string task_report_html(const TaskAnalysis& analysis, const std::string& program_version);
/// Every number, 17 significant digits. An infinite end of an interval is null.
std::string task_report_json(const TaskAnalysis& analysis, const std::string& program_version);

}  // namespace palpate::analysis
