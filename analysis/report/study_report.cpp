#include "analysis/report/study_report.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "analysis/report/report.h"

namespace palpate::analysis {
namespace {

/// A study of shapes has no cells of tasks.
bool is_identification_alone(const StudyAnalysis& analysis) { return analysis.cells.empty(); }

}  // namespace

std::string study_text(const StudyAnalysis& analysis) {
  return is_identification_alone(analysis) ? report_text(*analysis.identification)
                                           : task_report_text(analysis);
}

std::string study_json(const StudyAnalysis& analysis) {
  return is_identification_alone(analysis) ? report_json(*analysis.identification)
                                           : task_report_json(analysis, analysis.program_version);
}

std::string study_html(const StudyAnalysis& analysis, const StudyRecord& record) {
  return is_identification_alone(analysis)
             ? report_html(*analysis.identification, record)
             : task_report_html(analysis, analysis.program_version, record);
}

std::vector<Figure> study_figures(const StudyAnalysis& analysis, const StudyRecord& record) {
  if (is_identification_alone(analysis)) return figures_of(*analysis.identification, record);
  std::vector<Figure> figures = between_figures(analysis);
  for (Figure& figure : task_figures(analysis)) figures.push_back(std::move(figure));
  if (analysis.identification) {
    for (Figure& figure : figures_of(*analysis.identification, {}))
      figures.push_back(std::move(figure));
  }
  return figures;
}

std::string label_of(const StudyTable& table) {
  if (table.trials.empty() && table.times) return simulated_label(table.times->simulated);
  const auto n =
      static_cast<std::size_t>(std::ranges::count(table.trials, true, &StudyTrial::simulated));
  return simulated_label(n == 0                     ? Simulated::no
                         : n == table.trials.size() ? Simulated::yes
                                                    : Simulated::mixed);
}

}  // namespace palpate::analysis
