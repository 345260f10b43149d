#include "analysis/table_cells.h"

#include <algorithm>
#include <cmath>

#include "analysis/text.h"

namespace palpate {

std::string number(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fixed(*value, decimals) : kMissing;
}

std::string percent(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fixed(*value, decimals) + " %" : kMissing;
}

std::optional<double> hundredfold(const std::optional<double>& share) {
  if (!share) return std::nullopt;
  return 100 * *share;
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
    notes.push_back("Undefined for " + joined(shapes) + ": " + reason + ".");
  }
}

}  // namespace palpate
