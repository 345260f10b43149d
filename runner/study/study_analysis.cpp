#include "runner/study/study_analysis.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "analysis/report/report.h"
#include "runner/study/study_trials.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

StudyTable read_study_table(const std::string& database, const std::string& protocol) {
  if (is_of_tasks(database, "", protocol)) return read_study_tasks(database, "", protocol);
  return read_study_trials(database, "", protocol);
}

StudyAnalysis analyze_study(StudyTable table, double too_fast) {
  analysis::AnalysisSettings settings;
  settings.too_fast = too_fast;
  if (auto* const tasks = std::get_if<analysis::TaskTable>(&table))
    return analysis::analyze_tasks(std::move(*tasks), {}, settings, PALPATE_VERSION);
  return analysis::analyze(std::move(std::get<analysis::TrialTable>(table)), settings,
                           PALPATE_VERSION);
}

std::string json_of(const StudyAnalysis& analysis) {
  if (const auto* const tasks = std::get_if<analysis::TaskAnalysis>(&analysis))
    return analysis::task_report_json(*tasks, PALPATE_VERSION);
  return analysis::report_json(std::get<analysis::Analysis>(analysis));
}

std::string html_of(const StudyAnalysis& analysis, const analysis::StudyRecord& record) {
  if (const auto* const tasks = std::get_if<analysis::TaskAnalysis>(&analysis))
    return analysis::task_report_html(*tasks, PALPATE_VERSION, record);
  return analysis::report_html(std::get<analysis::Analysis>(analysis), record);
}

std::vector<analysis::Figure> figures_of(const StudyAnalysis& analysis,
                                         const analysis::StudyRecord& record) {
  const auto* const tasks = std::get_if<analysis::TaskAnalysis>(&analysis);
  if (tasks == nullptr) return analysis::figures_of(std::get<analysis::Analysis>(analysis), record);
  std::vector<analysis::Figure> figures = analysis::task_figures(*tasks);
  if (tasks->identification) {
    for (analysis::Figure& figure : analysis::figures_of(*tasks->identification, {}))
      figures.push_back(std::move(figure));
  }
  return figures;
}

std::string label_of(const StudyTable& table) {
  if (const auto* const times = std::get_if<analysis::TrialTable>(&table))
    return analysis::simulated_label(times->simulated);
  const auto& trials = std::get<analysis::TaskTable>(table).trials;
  const auto n =
      static_cast<std::size_t>(std::ranges::count(trials, true, &analysis::TaskTrial::simulated));
  return analysis::simulated_label(n == 0               ? analysis::Simulated::no
                                   : n == trials.size() ? analysis::Simulated::yes
                                                        : analysis::Simulated::mixed);
}

}  // namespace palpate::runner::study
