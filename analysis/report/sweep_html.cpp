#include "analysis/figures/sweep_figures.h"
#include "analysis/report/html_elements.h"
#include "analysis/report/html_page.h"
#include "analysis/report/sweep_report.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

std::string link_of(const std::string& figure) {
  return figure == "gains" ? "Gains" : figure == "drivers" ? "Drivers" : "Scatter";
}

void put_pattern(HtmlPage& page, const SweepAnalysis& analysis) {
  page.begin_section("pattern", "The pattern", "Pattern");
  page.body() +=
      "<pre tabindex=\"0\">" + escaped(printable(analysis.pattern->expression, 2000)) + "</pre>\n";
  page.put_note("A shape's name stands for its gain in percent. " + pattern_note(analysis));
  page.end_section();
}

Table sweep_source_table(const SweepAnalysis& analysis) {
  const SweepTable& sweep = analysis.table;
  Table table;
  table.caption = "What was swept";
  table.header = {"what", "value"};
  table.n_names = 2;
  table.rows = {
      {"file", sweep.source},
      {"protocol", sweep.protocol_name},
      {"design", sweep.design},
      {"points on record", std::to_string(sweep.rows()) + " of " + std::to_string(sweep.planned)},
      {"failed", std::to_string(analysis.n_failed)},
      {"seed", std::to_string(sweep.seed)},
      {"participants at each point", std::to_string(sweep.participants)},
      {"repetitions", std::to_string(sweep.repetitions)},
      {"simulated with palpate", sweep.program_version},
      {"analysed with palpate", analysis.program_version},
      {"parameters", joined(sweep.parameters)}};
  return table;
}

}  // namespace

std::string sweep_html(const SweepAnalysis& analysis) {
  HtmlPage page(sweep_answer(analysis), "SIMULATED PARTICIPANTS");
  page.put_banner(
      "SIMULATED PARTICIPANTS: all numbers below are from a model of a participant, not from "
      "humans.");
  put_list(page.below_title(), analysis.notes);
  if (analysis.pattern) put_pattern(page, analysis);
  for (const Figure& figure : sweep_figures(analysis))
    page.put_figure_section(figure, link_of(figure.id));
  page.begin_section("numbers", "Numbers", "Numbers");
  for (const Table& table : sweep_tables(analysis)) put_table(page.body(), table);
  page.end_section();
  page.begin_section("source", "Source", "Source");
  put_table(page.body(), sweep_source_table(analysis));
  page.end_section();
  return page.html("Made by palpate " + analysis.program_version + ".");
}

}  // namespace palpate::analysis
