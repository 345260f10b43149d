#pragma once
// Figures as the cells of a table show them: a dash for what is not there, or is no number.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

inline constexpr const char* kMissing = "–";

std::string number(const std::optional<double>& value, int decimals);
/// "12.3 %"; `value` in percent.
std::string percent(const std::optional<double>& value, int decimals = 1);
/// Percent of a share.
std::optional<double> hundredfold(const std::optional<double>& share);
/// A change: with its sign.
std::string signed_fixed(double value, int decimals);
std::string p_or_missing(const std::optional<double>& p);
/// "3.1 to 12.0", percent reductions.
std::string reduction_interval(const std::optional<Interval>& log_ratio);

/// "Response times" or "Response times (SIMULATED PARTICIPANTS)".
std::string caption(const Analysis& analysis, const std::string& what);

/// Whether there is more than one comparison: then its renderer stands before the shape in a
/// table's rows, and after it where shapes are listed.
bool several(const Analysis& analysis);
/// A table with a row for each comparison and shape. \param header without the names' columns
Table comparison_table(const Analysis& analysis, const std::string& what,
                       const std::vector<std::string>& header);
/// The names of one of its rows.
std::vector<std::string> row_names(const Analysis& analysis, const RendererPair& pair,
                                   const std::string& shape);
/// A shape where shapes are listed: "cone" or "cone (tube)".
std::string listed_shape(const Analysis& analysis, const RendererPair& pair,
                         const std::string& shape);

/// How short BCa's intervals are with as few pairs as there are; empty where there are enough.
std::string narrow_bootstrap_note(const Analysis& analysis);

/// A note for each reason, with the shapes that it holds for.
class Reasons {
 public:
  void add(const std::string& reason, const std::string& shape);
  void put(std::vector<std::string>& notes) const;

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> reasons_;
};

}  // namespace palpate::analysis
