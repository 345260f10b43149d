#include "analysis/report/table_cells.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::ptrdiff_t kMostListed = 200;  // shapes in a note

}  // namespace

std::string number(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fixed(*value, decimals) : kMissing;
}

std::string percent(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fixed(*value, decimals) + " %" : kMissing;
}

std::optional<double> to_percent(const std::optional<double>& proportion) {
  if (!proportion) return std::nullopt;
  return 100 * *proportion;
}

std::string signed_fixed(double value, int decimals) {
  if (!std::isfinite(value)) return kMissing;
  const std::string text = fixed(value, decimals);
  return (value > 0 && text.find_first_not_of("0.") != std::string::npos ? "+" : "") + text;
}

std::string p_or_missing(const std::optional<double>& p) { return p ? p_text(*p) : kMissing; }

std::string reduction_interval(const std::optional<Interval>& log_ratio) {
  if (!log_ratio) return kMissing;
  const Interval ends = percent_reduction(*log_ratio);
  return number(ends.low, 1) + " to " + number(ends.high, 1);
}

std::string caption(const Analysis& analysis, const std::string& what) {
  const std::string label = simulated_label(analysis.table.simulated);
  return label.empty() ? what : what + " (" + label + ")";
}

bool has_several_comparisons(const Analysis& analysis) { return analysis.comparisons.size() > 1; }

Table comparison_table(const Analysis& analysis, const std::string& what,
                       const std::vector<std::string>& header) {
  Table table;
  table.caption = caption(analysis, what);
  if (has_several_comparisons(analysis)) table.header.emplace_back("renderer");
  table.header.emplace_back("shape");
  table.n_names = table.header.size();
  table.header.insert(table.header.end(), header.begin(), header.end());
  return table;
}

std::vector<std::string> row_names(const Analysis& analysis, const RendererPair& pair,
                                   const std::string& shape) {
  if (has_several_comparisons(analysis)) return {pair.renderer, shape};
  return {shape};
}

std::string listed_shape(const Analysis& analysis, const RendererPair& pair,
                         const std::string& shape) {
  return has_several_comparisons(analysis) ? shape + " (" + pair.renderer + ")" : shape;
}

std::string narrow_bootstrap_note(const Analysis& analysis) {
  std::map<std::size_t, double> by_pairs;
  for (const Comparison& comparison : analysis.comparisons) {
    for (const PairedShape& shape : comparison.shapes) {
      const auto coverage = bca_coverage(shape.n_pairs);
      if (shape.bootstrap.log_ratio_ci95 && coverage) by_pairs[shape.n_pairs] = *coverage;
    }
  }
  if (by_pairs.empty()) return {};
  std::string text;
  for (const auto& [pairs, coverage] : by_pairs) {
    text += (text.empty() ? "" : ", ") + fixed(100 * coverage, 0) + " % with " +
            std::to_string(pairs) + " pairs";
  }
  return "BCa intervals are too short for few participants: instead of 95 % their coverage is " +
         text +
         " (simulated, normal differences; the t interval: 95 %). With skewed differences the "
         "coverage of both is lower.";
}

void Reasons::add(const std::string& reason, const std::string& shape) {
  if (reason.empty()) return;
  for (auto& [known, shapes] : reasons_) {
    if (known != reason) continue;
    if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) shapes.push_back(shape);
    return;
  }
  reasons_.push_back({reason, {shape}});
}

void Reasons::put(std::vector<std::string>& notes) const {
  for (const auto& [reason, shapes] : reasons_) {
    std::vector<std::string> named(shapes.begin(),
                                   shapes.begin() + std::min(std::ssize(shapes), kMostListed));
    if (named.size() < shapes.size()) {
      named.push_back(std::to_string(shapes.size() - named.size()) + " more");
    }
    notes.push_back("Undefined for " + joined(named) + ": " + reason + ".");
  }
}

}  // namespace palpate::analysis
