#pragma once
// The analysis of a study, of identification or of tasks: one form for the commands that write it.

#include <string>
#include <variant>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/task_analysis.h"

namespace palpate::runner::study {

using StudyAnalysis = std::variant<analysis::Analysis, analysis::TaskAnalysis>;
/// The trials of a study, as they were read.
using StudyTable = std::variant<analysis::TrialTable, analysis::TaskTable>;

/// \param protocol  as in study_trials.h \throws as read_study_trials and read_study_tasks
StudyTable read_study_table(const std::string& database, const std::string& protocol);

/// \param too_fast  s, limit of too fast answers
StudyAnalysis analyze_study(StudyTable table, double too_fast);

std::string json_of(const StudyAnalysis& analysis);
std::string html_of(const StudyAnalysis& analysis, const analysis::StudyRecord& record);
std::vector<analysis::Figure> figures_of(const StudyAnalysis& analysis,
                                         const analysis::StudyRecord& record);

/// "SIMULATED PARTICIPANTS"; "": people.
std::string label_of(const StudyTable& table);

}  // namespace palpate::runner::study
