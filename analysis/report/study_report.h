#pragma once
// The report of a study, whatever it asked: that of its tasks, or of identification alone.

#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/input/study_record.h"
#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {

std::string study_text(const StudyAnalysis& analysis);
std::string study_json(const StudyAnalysis& analysis);
/// \param record  empty: the source is a table
std::string study_html(const StudyAnalysis& analysis, const StudyRecord& record);
std::vector<Figure> study_figures(const StudyAnalysis& analysis, const StudyRecord& record);

}  // namespace palpate::analysis
