#include "analysis/report_cards.h"

#include <algorithm>
#include <cstddef>

#include "analysis/report_page.h"
#include "analysis/text.h"
#include "analysis/wording.h"

namespace palpate {

namespace {

constexpr std::size_t kMostCards = 12, kMostRowsOfCards = 4;

void put_card(std::string& out, const PairedShape& shape, const std::string& name,
              const std::string& paper) {
  const auto& p = shape.t_test.p_holm;
  const bool clear = p && *p < 0.05;
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
           "\u00a0%</small><small>";
  }
  out += p ? std::string(clear ? "clear" : "no clear difference") + ", adjusted p " +
                 (*p < 0.001 ? "" : "= ") + escaped(p_text(*p))
           : "not testable";
  if (!paper.empty()) out += "</small><small>paper: " + escaped_sentence(paper);
  out += "</small></li>\n";
}

}  // namespace

void put_cards(std::string& out, const Analysis& analysis) {
  const std::vector<Comparison>& all = analysis.comparisons;
  const std::size_t rows = std::min(all.size(), kMostRowsOfCards);
  const std::size_t n = std::min(analysis.table.shapes.size(), kMostCards);
  for (std::size_t c = 0; c < rows; ++c) {
    std::string compared = with_renderer(analysis, "against");
    if (all.size() > 1) {
      compared = "with " + the(printable(all[c].pair.renderer, 80)) + " " + compared;
      out += "<p class=\"study\">" + escaped(compared) + "</p>\n";
    }
    out += "<ul class=\"cards\" aria-label=\"Reduction of the time " + escaped(compared) +
           ", by shape\">\n";
    for (std::size_t s = 0; s < n; ++s) {
      const std::string& name = analysis.table.shapes[s];
      put_card(out, all[c].shapes[s], name, paper_reduction(all[c].pair, name));
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

}  // namespace palpate
