#pragma once
// Numbers as text of table cells; a dash for a missing or non-finite one.

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
/// 100 times a proportion.
std::optional<double> to_percent(const std::optional<double>& proportion);
/// Fixed notation with the sign, also +.
std::string signed_fixed(double value, int decimals);
std::string p_or_missing(const std::optional<double>& p);
/// An interval of log ratios as percent reductions: "3.1 to 12.0".
std::string reduction_interval(const std::optional<Interval>& log_ratio);

/// "Response times" or "Response times (SIMULATED PARTICIPANTS)".
std::string caption(const Analysis& analysis, const std::string& what);

/// Whether there is more than one comparison: then rows of tables are named by renderer and shape,
/// not by shape.
bool has_several_comparisons(const Analysis& analysis);
/// An empty table for a row for each comparison and shape. \param header of the columns after the
/// names
Table comparison_table(const Analysis& analysis, const std::string& what,
                       const std::vector<std::string>& header);
/// The name cells of a row of such a table.
std::vector<std::string> row_names(const Analysis& analysis, const RendererPair& pair,
                                   const std::string& shape);
/// A shape in a list: "cone", or "cone (tube)" with several comparisons.
std::string listed_shape(const Analysis& analysis, const RendererPair& pair,
                         const std::string& shape);

/// Coverage of the BCa intervals for the numbers of pairs in the data; empty if all are 20 or more.
std::string narrow_bootstrap_note(const Analysis& analysis);

/// Collects why values are undefined; one note for each reason, with its shapes.
class Reasons {
 public:
  void add(const std::string& reason, const std::string& shape);
  void put(std::vector<std::string>& notes) const;

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> reasons_;
};

}  // namespace palpate::analysis
