#include "analysis/report/reduction_cards.h"

#include <algorithm>
#include <cstddef>

#include "analysis/report/html_elements.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr double kSignificanceLevel = 0.05;
constexpr std::size_t kMostCards = 12, kMostRowsOfCards = 4;

/// Outcome of the t-test at alpha 0.05: Holm-adjusted, and unadjusted where the two differ.
std::string verdict(const TTest& test, std::size_t tests) {
  if (!test.p_holm) return "not testable";
  const auto p_is = [](double p) { return std::string(p < 0.001 ? "p " : "p = ") + p_text(p); };
  const std::string adjusted = "adjusted " + p_is(*test.p_holm);
  if (*test.p_holm < kSignificanceLevel) return "clear, " + adjusted;
  if (*test.p >= kSignificanceLevel) return "no clear difference, " + adjusted;
  return "no clear difference among " + std::to_string(tests) + " tests, " + adjusted +
         " (by itself " + p_is(*test.p) + ")";
}

/// \param censored null: no time-outs \param tests number of tests that p is adjusted for
void put_card(std::string& out, const PairedShape& shape, const CensoredEstimate* censored,
              const std::string& name, const std::string& paper, std::size_t tests) {
  const auto& p = shape.t_test.p_holm;
  const bool clear = p && *p < kSignificanceLevel;
  const bool slower = shape.mean_log_ratio && *shape.mean_log_ratio > 0;
  out += "<li";
  if (clear) out += slower ? " class=\"slower\"" : " class=\"clear\"";
  out += "><b>" + escaped(printable(name, 80)) + "</b><span class=\"value\">";
  if (const auto& reduction = shape.percent_reduction_geometric) {
    out += fixed(*reduction < 0 ? -*reduction : *reduction, 1) + "\u00a0%</span> " +
           (slower ? "slower" : "faster");
  } else {
    out += "–</span>";
  }
  out += "<small>";
  if (shape.t_test.log_ratio_ci95) {
    const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
    out += "95\u00a0% interval " + fixed(ends.low, 1) + " to " + fixed(ends.high, 1) +
           "\u00a0%, not adjusted</small><small>";
  }
  out += escaped(verdict(shape.t_test, tests));
  if (censored && censored->n_censored > 0 && censored->log_ratio) {
    out += "</small><small>with its " + counted(censored->n_censored, "time-out", "time-outs") +
           " as censored times: " +
           escaped_sentence(fixed(percent_reduction(*censored->log_ratio), 1) + " %");
    if (censored->log_ratio_ci95) {
      const Interval ends = percent_reduction(*censored->log_ratio_ci95);
      out += " (" + fixed(ends.low, 1) + " to " + fixed(ends.high, 1) + ")";
    }
  }
  if (!paper.empty()) out += "</small><small>paper: " + escaped_sentence(paper);
  out += "</small></li>\n";
}

}  // namespace

void put_reduction_cards(std::string& out, const Analysis& analysis) {
  const std::vector<Comparison>& all = analysis.comparisons;
  const std::size_t rows = std::min(all.size(), kMostRowsOfCards);
  const std::size_t n = std::min(analysis.table.shapes.size(), kMostCards);
  std::size_t tests = 0;
  for (const Comparison& comparison : all) {
    tests += static_cast<std::size_t>(std::ranges::count_if(
        comparison.shapes, [](const PairedShape& shape) { return shape.t_test.p.has_value(); }));
  }
  for (std::size_t c = 0; c < rows; ++c) {
    std::string compared = with_renderer(analysis, "against");
    if (all.size() > 1) {
      compared = "with " + with_article(printable(all[c].pair.renderer, 80)) + " " + compared;
      out += "<p class=\"study\">" + escaped(compared) + "</p>\n";
    }
    out += "<ul class=\"cards\" aria-label=\"Reduction of the time " + escaped(compared) +
           ", by shape\">\n";
    for (std::size_t s = 0; s < n; ++s) {
      const std::string& name = analysis.table.shapes[s];
      put_card(out, all[c].shapes[s], all[c].censored.empty() ? nullptr : &all[c].censored[s], name,
               paper_reduction(all[c].pair, name), tests);
    }
    out += "</ul>\n";
  }
  if (n < analysis.table.shapes.size()) {
    out += "<p class=\"note\">The first " + std::to_string(n) + " of " +
           std::to_string(analysis.table.shapes.size()) + " shapes.</p>\n";
  }
  if (rows < all.size()) {
    out += "<p class=\"note\">The first " + std::to_string(rows) + " of " +
           std::to_string(all.size()) + " comparisons.</p>\n";
  }
}

}  // namespace palpate::analysis
