#include "runner/commands/sweep/analyze.h"

#include "analysis/figures/figure_svg.h"
#include "analysis/figures/sweep_figures.h"
#include "analysis/report/sweep_report.h"
#include "analysis/statistics/pattern.h"
#include "data/store/sweep_file.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner {

std::string analyze_sweep_file(const std::string& file, const std::string& pattern,
                               Outputs& outputs) {
  try {
    const analysis::SweepAnalysis analysis =
        analysis::analyze_sweep(analysis::read_sweep_table(file), pattern, PALPATE_VERSION);
    if (outputs.wanted("figures")) {
      for (const analysis::Figure& figure : analysis::sweep_figures(analysis)) {
        outputs.put_into_folder(figure.id + ".svg",
                                analysis::figure_svg(figure, analysis::light_palette()));
      }
    }
    if (outputs.wanted("json")) outputs.put("json", analysis::sweep_json(analysis));
    if (outputs.wanted("report")) outputs.put("report", analysis::sweep_html(analysis));
    return analysis::sweep_text(analysis);
  } catch (const analysis::PatternError& error) {
    throw UsageError(error.what());
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the file that was named is bad input: status 2
  }
}

}  // namespace palpate::runner
