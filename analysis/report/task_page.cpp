#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/answer_model_report.h"
#include "analysis/report/design_report.h"
#include "analysis/report/html_page.h"
#include "analysis/report/report.h"
#include "analysis/report/task_tables.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

/// The study's title, or its name, or its file.
std::string study_of(const StudyTable& table) {
  if (!table.title.empty()) return table.title;
  for (const auto& [name, sha256] : table.protocols) {
    if (!name.empty()) return name;
  }
  return "Tasks of " + table.source;
}

/// On a page lines end where there is no room left.
std::string without_line_ends(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return text;
}

/// "left 3, right 9", or "20 to 31, mean 24.5, SD 3.2"
std::string described_answers(const data::ParticipantColumn& column) {
  std::map<std::string, std::size_t> counts;
  for (const std::string& choice : column.from.choices) counts[choice] = 0;
  std::vector<double> numbers;
  for (const auto& [code, answer] : column.answers) {
    ++counts[answer];
    double value = 0;
    const auto [end, error] = std::from_chars(answer.data(), answer.data() + answer.size(), value);
    if (error == std::errc() && end == answer.data() + answer.size()) numbers.push_back(value);
  }
  if (column.answers.empty()) return kMissing;
  if (column.from.number && numbers.size() == column.answers.size()) {
    const auto [least, most] = std::ranges::minmax(numbers);
    double mean = 0, squares = 0;
    for (const double one : numbers) mean += one / static_cast<double>(numbers.size());
    for (const double one : numbers) squares += (one - mean) * (one - mean);
    std::string text =
        short_number(least) + " to " + short_number(most) + ", mean " + short_number(mean);
    if (numbers.size() > 1)
      text += ", SD " + short_number(std::sqrt(squares / static_cast<double>(numbers.size() - 1)));
    return text;
  }
  // A text could tell who wrote it.
  if (column.from.choices.empty())
    return counted(counts.size(), "different answer", "different answers");
  std::string text;
  for (const std::string& choice : column.from.choices)
    text += (text.empty() ? "" : ", ") + choice + " " + std::to_string(counts[choice]);
  return text;
}

Table people_table(const StudyTable& source, const std::string& label) {
  Table table;
  table.caption = label.empty() ? "Who took part" : "Who took part, " + label;
  table.header = {"column", "question", "answers", "answered"};
  table.n_names = 3;
  std::set<std::string> codes;
  for (const StudyTrial& trial : source.trials) codes.insert(trial.participant);
  for (const data::ParticipantColumn& one : source.people) {
    table.rows.push_back(
        {one.from.column, printable(one.from.question, 200), printable(described_answers(one), 400),
         std::to_string(one.answers.size()) + " of " + std::to_string(codes.size())});
  }
  table.notes = {"Answers to the questions of pages that name a column of participants."};
  return table;
}

/// Sections of a page of tasks: results over participants, figures, each task's numbers.
class TaskPage {
 public:
  TaskPage(const StudyAnalysis& analysis, const StudyRecord& record)
      : analysis_(analysis),
        record_(record),
        label_(analysis.table.simulated ? "SIMULATED PARTICIPANTS" : ""),
        figures_(task_figures(analysis)),
        page_(headline(analysis), label_) {}

  std::string html(const std::string& program_version) {
    put_header();
    put_people();
    put_groups();
    put_answer_models();
    put_results();
    put_figures(true);
    put_cells();
    put_figures(false);
    put_identification();
    put_registration_section(page_, record_.checked, record_.check_page);
    return page_.html("Analysed with palpate " + program_version + ".");
  }

 private:
  void put_header() {
    const StudyTable& source = analysis_.table;
    if (source.simulated)
      page_.put_banner(
          "SIMULATED PARTICIPANTS: numbers below are from a model of a participant, not from "
          "humans.");
    page_.above_title() +=
        "<p class=\"study\">" + escaped(printable(study_of(source), 400)) + "</p>\n";
    page_.below_title() += "<p class=\"lead\">" + counted(source.trials.size(), "trial", "trials") +
                           " of " + escaped(printable(source.source, 400)) + "</p>\n";
    if (source.warnings.empty()) return;
    page_.below_title() += "<div class=\"warnings\" aria-label=\"Warnings\">\n";
    put_list(page_.below_title(), source.warnings);
    page_.below_title() += "</div>\n";
  }

  void put_people() {
    if (analysis_.table.people.empty()) return;
    page_.begin_section("people", "Participants", "Participants");
    put_table(page_.body(), people_table(analysis_.table, label_));
    page_.end_section();
  }

  void put_groups() {
    if (analysis_.by_design.empty()) return;
    page_.begin_section("groups", "Groups of participants", "Groups");
    for (const Figure& figure : between_figures(analysis_)) page_.put_figure(figure);
    for (const Table& table : design_tables(analysis_.by_design, label_))
      put_table(page_.body(), table);
    page_.end_section();
  }

  void put_answer_models() {
    if (analysis_.answer_models.empty()) return;
    page_.begin_section("answers", "Mixed model of all answers", "All answers");
    for (const Table& table : answer_model_tables(analysis_.answer_models, label_))
      put_table(page_.body(), table);
    page_.end_section();
  }

  void put_results() {
    const std::vector<Table> groups = group_tables(analysis_),
                             summaries = summary_tables(analysis_);
    if (groups.empty() && summaries.empty()) return;
    page_.begin_section("participants", "Results over participants", "Results over participants");
    for (const Table& table : groups) put_table(page_.body(), table);
    put_quotable(page_.body(), sentences_to_quote(analysis_));
    for (const Table& table : summaries) put_table(page_.body(), table);
    page_.end_section();
  }

  /// \param of_all  of results over participants; otherwise of each one's functions and tracks
  void put_figures(bool of_all) {
    for (const Figure& figure : figures_) {
      const bool single = figure.id.starts_with("function") || figure.id.starts_with("track");
      if (single != of_all) page_.put_figure_section(figure, figure.title);
    }
  }

  void put_cells() {
    page_.begin_section("numbers", "Numbers of each participant", "Numbers");
    for (const TaskCell& cell : analysis_.cells) {
      const std::vector<Table> tables = cell_tables(cell, label_);
      if (tables.empty()) continue;
      put_collapsible_tables(page_.body(),
                             stimulus_of(cell.task, cell.block_name, cell.shape) + ", " +
                                 printable(cell.renderer) + ": " +
                                 counted(cell.trials, "trial", "trials") + " of " +
                                 counted(cell.participants.size(), "participant", "participants") +
                                 ", " + std::to_string(cell.answered) + " answered",
                             tables);
    }
    page_.put_note(without_line_ends(explanation(analysis_) + scale_note(analysis_)));
    page_.end_section();
  }

  void put_identification() {
    if (!analysis_.identification) return;
    for (const Figure& figure : figures_of(*analysis_.identification, {}))
      page_.put_figure_section(figure, figure.title);
    page_.begin_section("identification", "Times and accuracy of identification", "Identification");
    for (const Table& table : all_tables(*analysis_.identification)) put_table(page_.body(), table);
    put_quotable(page_.body(), sentences_to_quote(*analysis_.identification));
    page_.end_section();
  }

  const StudyAnalysis& analysis_;
  const StudyRecord& record_;
  std::string label_;
  std::vector<Figure> figures_;
  HtmlPage page_;
};

}  // namespace

std::string task_report_html(const StudyAnalysis& analysis, const std::string& program_version,
                             const StudyRecord& record) {
  return TaskPage(analysis, record).html(program_version);
}

}  // namespace palpate::analysis
