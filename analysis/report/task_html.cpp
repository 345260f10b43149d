#include "analysis/figures/figures.h"
#include "analysis/figures/task_figures.h"
#include "analysis/report/html_elements.h"
#include "analysis/report/html_page.h"
#include "analysis/report/task_report.h"
#include "analysis/text.h"

namespace palpate::analysis {

std::string task_report_html(const TaskAnalysis& analysis, const std::string& program_version) {
  const std::string label = analysis.table.simulated ? "SIMULATED PARTICIPANTS" : "";
  HtmlPage page("Tasks of " + stimuli::printable(analysis.table.source), label);
  if (analysis.table.simulated)
    page.put_banner(
        "SIMULATED PARTICIPANTS: numbers below are from a model of a participant, not from "
        "humans.");
  page.begin_section("numbers", "Numbers", "Numbers");
  page.body() += "<pre tabindex=\"0\">" + escaped(task_report_text(analysis)) + "</pre>\n";
  page.end_section();
  for (const Figure& figure : task_figures(analysis)) page.put_figure_section(figure, figure.id);
  if (analysis.identification) {
    for (const Figure& figure : figures_of(*analysis.identification, {}))
      page.put_figure_section(figure, figure.id);
  }
  return page.html("Analysed with palpate " + program_version + ".");
}

}  // namespace palpate::analysis
