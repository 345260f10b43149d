#include "analysis/statistics/sweep_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/statistics/comparison.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/quantiles.h"

namespace palpate::analysis {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
/// "Cone 22 %, cube 11 %, no difference for sphere and cylinder", without its sizes.
constexpr const char* kPaperPattern =
    "cone > 5 && cube > 5 && min(cone, cube) > max(sphere, cylinder)";

bool has_papers_shapes(const SweepTable& table) {
  if (table.renderers != std::vector<std::string>{"point", "ray"}) return false;
  return std::all_of(kPaperEffects.begin(), kPaperEffects.end(), [&](const PaperEffect& effect) {
    return std::count(table.shapes.begin(), table.shapes.end(), effect.shape) > 0;
  });
}

Pattern pattern_of(const SweepTable& table, const std::string& expression) {
  const auto resolve = [&](const std::string& name) -> std::optional<std::size_t> {
    const auto gain = table.column("gain_" + name);
    return gain ? gain : table.column(name);
  };
  std::vector<std::string> known = table.shapes;
  known.insert(known.end(), table.columns.begin(), table.columns.end());
  return {expression, resolve, known};
}

/// Saltelli's design: samples A and B, the first two of each base point.
bool independent_setting(const SweepTable& table, std::size_t row) {
  if (table.design != "saltelli") return true;
  const auto each = static_cast<std::int64_t>(table.parameters.size()) + 2;
  return (table.points[row] - 1) % each < 2;
}

Spread spread_of(const std::vector<double>& values, const std::vector<double>& errors) {
  std::vector<double> sorted;
  double squared_errors = 0;
  std::size_t with_errors = 0, positive = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    sorted.push_back(values[i]);
    positive += values[i] > 0 ? 1 : 0;
    if (std::isnan(errors[i])) continue;
    squared_errors += errors[i] * errors[i];
    ++with_errors;
  }
  Spread out;
  out.n = sorted.size();
  if (sorted.empty()) return out;
  std::sort(sorted.begin(), sorted.end());
  out.mean = mean(sorted);
  out.sd = standard_deviation(sorted);
  out.least = sorted.front();
  out.greatest = sorted.back();
  out.q05 = sorted_quantile(sorted, 0.05);
  out.q25 = sorted_quantile(sorted, 0.25);
  out.q50 = sorted_quantile(sorted, 0.5);
  out.q75 = sorted_quantile(sorted, 0.75);
  out.q95 = sorted_quantile(sorted, 0.95);
  out.share_positive = static_cast<double>(positive) / static_cast<double>(out.n);
  if (out.sd && *out.sd > 0 && with_errors > 0)
    out.noise_share = squared_errors / static_cast<double>(with_errors) / (*out.sd * *out.sd);
  return out;
}

/// All values in the order of Saltelli's samples, with gaps for points not on record.
std::vector<double> all_samples(const SweepTable& table, const std::vector<double>& values) {
  if (values.empty()) return {};
  std::vector<double> out(static_cast<std::size_t>(table.points.back()), kUnknown);
  for (std::size_t row = 0; row < table.rows(); ++row)
    out[static_cast<std::size_t>(table.points[row]) - 1] = values[row];
  return out;
}

/// Choices of more than two words have no order.
bool ordered(const SweepTable& table, std::size_t parameter) {
  return table.words[parameter].size() <= 2;
}

/// \param errors  standard errors of the values; empty: unknown
Drivers drivers_of(const SweepTable& table, std::string output, std::vector<double> values,
                   const std::vector<double>& errors, std::uint64_t seed) {
  Drivers out;
  out.output = std::move(output);
  out.values = std::move(values);
  const std::size_t n = table.parameters.size();
  if (table.design == "saltelli") {
    out.sobol = sobol_indices(all_samples(table, out.values), all_samples(table, errors), n, seed);
  } else {
    std::vector<std::vector<double>> inputs(table.values.begin(),
                                            table.values.begin() + static_cast<std::ptrdiff_t>(n));
    for (std::size_t p = 0; p < n; ++p) {
      if (!ordered(table, p)) inputs[p].assign(table.rows(), 0);  // treated as constant
    }
    out.ranks = rank_correlations(inputs, out.values);
    for (std::size_t p = 0; p < n; ++p) {
      if (!ordered(table, p)) out.ranks[p].undefined = "more than two words have no order";
    }
  }
  for (std::size_t p = 0; p < n; ++p) {
    const bool known =
        out.sobol ? out.sobol->of[p].total.has_value() : out.ranks[p].spearman.has_value();
    if (known) out.strongest.push_back(p);
  }
  std::stable_sort(out.strongest.begin(), out.strongest.end(),
                   [&](std::size_t a, std::size_t b) { return out.strength(a) > out.strength(b); });
  return out;
}

void add_notes(SweepAnalysis& analysis) {
  const SweepTable& table = analysis.table;
  if (static_cast<std::int64_t>(table.rows()) < table.planned) {
    analysis.notes.push_back("The file holds " + std::to_string(table.rows()) + " of " +
                             std::to_string(table.planned) + " points: " +
                             (table.design == "lhs" || table.design == "grid"
                                  ? "part of a design does not represent the whole space."
                                  : "estimates are less precise than those of the whole sweep."));
  }
  if (table.design == "grid") {
    analysis.notes.push_back(
        "A grid's levels are equally spaced with both ends: they are not a sample of the "
        "distributions. Shares, quantiles and means are of the grid's points, not of the space, "
        "and have no interval. To estimate those of the space, use --design lhs or sobol.");
  }
  if (analysis.n_failed > 0) {
    analysis.notes.push_back(
        std::to_string(analysis.n_failed) +
        " points failed and are excluded from all figures: if they did not fail at random, the "
        "others do not represent the space.");
  }
}

}  // namespace

PatternShare pattern_share(const SweepTable& table, const std::string& expression) {
  const Pattern pattern = pattern_of(table, expression);
  PatternShare out;
  out.expression = expression;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    std::optional<bool> holds;
    if (!table.failed[row])
      holds = pattern.holds([&](std::size_t column) { return table.values[column][row]; });
    out.at.push_back(holds ? (*holds ? 1 : 0) : kUnknown);
    if (!independent_setting(table, row)) continue;
    out.undefined += holds ? 0 : 1;
    out.n += holds ? 1 : 0;
    out.holds += holds && *holds ? 1 : 0;
  }
  if (out.n > 0) {
    out.share = static_cast<double>(out.holds) / static_cast<double>(out.n);
    if (table.design != "grid") out.ci95 = wilson_interval(out.holds, out.n);
  }
  return out;
}

double Drivers::strength(std::size_t parameter) const {
  if (sobol) return sobol->of[parameter].total.value_or(0);
  const RankCorrelation& one = ranks[parameter];
  return std::fabs(one.partial ? *one.partial : one.spearman.value_or(0));
}

SweepAnalysis analyze_sweep(SweepTable table, const std::string& pattern,
                            const std::string& program_version) {
  SweepAnalysis out;
  out.table = std::move(table);
  out.program_version = program_version;
  out.n_failed =
      static_cast<std::size_t>(std::count(out.table.failed.begin(), out.table.failed.end(), true));
  if (!pattern.empty()) {
    out.pattern = pattern_share(out.table, pattern);
  } else if (has_papers_shapes(out.table)) {
    out.pattern = pattern_share(out.table, kPaperPattern);
    out.pattern->of_the_paper = true;
  }
  for (const std::string& shape : out.table.shapes) {
    const std::vector<double>& gains = out.table.values[*out.table.column("gain_" + shape)];
    const std::vector<double>& errors = out.table.values[*out.table.column("gain_se_" + shape)];
    out.gains.push_back(spread_of(gains, errors));
  }
  for (const data::EstimateColumns& one : out.table.estimates)
    out.drivers.push_back(drivers_of(out.table, one.estimate,
                                     out.table.values[*out.table.column(one.estimate)],
                                     out.table.values[*out.table.column(one.error)], out.seed));
  if (out.pattern)
    out.drivers.push_back(drivers_of(out.table, "pattern", out.pattern->at, {}, out.seed));
  add_notes(out);
  return out;
}

}  // namespace palpate::analysis
