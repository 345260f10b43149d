#include <cmath>

#include "analysis/figures/figures.h"
#include "analysis/figures/task_figures.h"
#include "analysis/report/html_elements.h"
#include "analysis/report/html_page.h"
#include "analysis/report/task_report.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr const char* kNoNumber = "–";

/// "compare, stiffness, ball"
std::string stimulus_of(const std::string& task, const std::string& block,
                        const std::string& shape) {
  std::string name = task;
  for (const std::string* part : {&block, &shape}) {
    if (!part->empty()) name += ", " + *part;
  }
  return name;
}

std::string interval_cell(const std::optional<Interval>& interval) {
  if (!interval) return kNoNumber;
  return short_number(interval->low) + " to " + short_number(interval->high);
}

Table group_table(const TaskAnalysis& analysis, const std::string& label) {
  Table table;
  table.caption = "Means over participants" + (label.empty() ? "" : " (" + label + ")");
  table.header = {"measure",       "task, block, stimulus", "renderer", "mean",
                  "95 % interval", "participants",          "left out"};
  table.n_names = 3;
  for (const TaskGroup& group : analysis.groups) {
    std::string measure = measure_plural(group.measure);
    if (!group.unit.empty()) measure += " (" + group.unit + ")";
    for (const GroupMean& one : group.renderers)
      table.rows.push_back({measure, stimulus_of(group.task, group.block_name, group.shape),
                            one.renderer, one.mean ? short_number(*one.mean) : kNoNumber,
                            interval_cell(one.ci95), std::to_string(one.participants.size()),
                            std::to_string(one.n_undetermined)});
  }
  table.notes = {
      "Geometric means where all values are positive and have a true zero, but of exponents; t "
      "intervals, of one participant none. Left out: functions without a threshold among the "
      "levels shown, or with answers the other way round."};
  return table;
}

Table comparison_table(const TaskAnalysis& analysis, const std::string& label) {
  Table table;
  table.caption = "The same participants, by renderer" + (label.empty() ? "" : " (" + label + ")");
  table.header = {"measure",       "task, block, stimulus",
                  "compared",      "value",
                  "95 % interval", "p",
                  "p (Holm)",      "dz",
                  "pairs"};
  table.n_names = 3;
  for (const TaskComparison& one : analysis.renderers) {
    for (const ConditionDifference& difference : one.comparison.differences) {
      const auto back = [&](double value) { return one.logarithms ? std::exp(value) : value; };
      std::optional<Interval> ends = difference.t_test.log_ratio_ci95;
      if (ends) ends = Interval{back(ends->low), back(ends->high)};
      const auto& test = difference.t_test;
      table.rows.push_back(
          {measure_plural(one.measure), stimulus_of(one.task, one.block_name, one.shape),
           one.conditions[difference.condition] + (one.logarithms ? " / " : " − ") +
               one.conditions[0],
           difference.n_pairs > 0 ? short_number(back(difference.mean)) : kNoNumber,
           interval_cell(ends), test.p ? p_text(*test.p) : kNoNumber,
           test.p_holm ? p_text(*test.p_holm) : kNoNumber,
           difference.effect_size.dz ? short_number(*difference.effect_size.dz) : kNoNumber,
           std::to_string(difference.n_pairs)});
    }
  }
  table.notes = {
      "Paired t-tests: of ratios (/) on natural logarithms where all values are positive and have "
      "a "
      "true zero, else of differences (−)."};
  return table;
}

/// The study's title, or its name, or its file.
std::string study_of(const TaskTable& table) {
  if (!table.title.empty()) return table.title;
  for (const auto& [name, sha256] : table.protocols) {
    if (!name.empty()) return name;
  }
  return "Tasks of " + table.source;
}

}  // namespace

std::string task_report_html(const TaskAnalysis& analysis, const std::string& program_version) {
  const TaskTable& source = analysis.table;
  const std::string label = source.simulated ? "SIMULATED PARTICIPANTS" : "";
  HtmlPage page(printable(study_of(source), 400), label);
  if (source.simulated)
    page.put_banner(
        "SIMULATED PARTICIPANTS: numbers below are from a model of a participant, not from "
        "humans.");
  page.below_title() += "<p class=\"lead\">Thresholds and other results of tasks, " +
                        counted(source.trials.size(), "trial", "trials") + " of " +
                        escaped(printable(source.source, 400)) + "</p>\n";
  if (!source.warnings.empty()) {
    page.below_title() += "<div class=\"warnings\" aria-label=\"Warnings\">\n";
    put_list(page.below_title(), source.warnings);
    page.below_title() += "</div>\n";
  }
  const std::vector<Figure> figures = task_figures(analysis);
  const auto put_figures = [&](bool of_groups) {
    for (const Figure& figure : figures) {
      if (figure.id.starts_with("group") == of_groups)
        page.put_figure_section(figure, figure.title);
    }
  };
  if (!analysis.groups.empty()) {
    page.begin_section("participants", "Results over participants", "Results over participants");
    put_table(page.body(), group_table(analysis, label));
    if (!analysis.renderers.empty()) put_table(page.body(), comparison_table(analysis, label));
    page.end_section();
  }
  put_figures(true);
  page.begin_section("numbers", "Numbers", "Numbers");
  page.body() += "<pre tabindex=\"0\">" + escaped_lines(task_report_text(analysis)) + "</pre>\n";
  page.end_section();
  put_figures(false);
  if (analysis.identification) {
    for (const Figure& figure : figures_of(*analysis.identification, {}))
      page.put_figure_section(figure, figure.title);
  }
  return page.html("Analysed with palpate " + program_version + ".");
}

}  // namespace palpate::analysis
