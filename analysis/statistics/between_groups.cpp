#include "analysis/statistics/between_groups.h"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>

#include "analysis/statistics/anova.h"
#include "analysis/statistics/describe.h"

namespace palpate::analysis {
namespace {

namespace bm = boost::math;

double quantile_975(double df) { return quantile(bm::students_t(df), 0.975); }

double mean_of_cells(const GroupedRow& row, std::size_t first, std::size_t count) {
  double sum = 0;
  for (std::size_t i = first; i < first + count; ++i) sum += row.values[i];
  return sum / static_cast<double>(count);
}

/// What of a participant is compared.
struct Compared {
  std::optional<std::size_t> condition;  ///< none: the mean over all cells
  bool of_difference = false;
};

/// Values of a group's participants. \param conditions  levels of the first factor
std::vector<double> compared_values(const std::vector<GroupedRow>& rows, std::size_t group,
                                    const Compared& what, std::size_t conditions) {
  std::vector<double> out;
  for (const GroupedRow& row : rows) {
    if (row.group != group) continue;
    const std::size_t cells = row.values.size(), of_one = cells / conditions;
    double value = what.condition ? mean_of_cells(row, *what.condition * of_one, of_one)
                                  : mean_of_cells(row, 0, cells);
    if (what.of_difference) value -= mean_of_cells(row, 0, of_one);
    out.push_back(value);
  }
  return out;
}

GroupMarginal marginal(const std::vector<double>& values) {
  GroupMarginal out;
  out.n = values.size();
  if (values.empty()) return out;
  out.mean = mean(values);
  const std::optional<double> sd = standard_deviation(values);
  if (!sd) return out;
  const auto n = static_cast<double>(values.size());
  out.se = *sd / std::sqrt(n);
  const double half = *out.se * quantile_975(n - 1);
  if (std::isfinite(half)) out.ci95 = Interval{*out.mean - half, *out.mean + half};
  return out;
}

void adjust_contrasts(std::vector<GroupContrast>& contrasts) {
  std::vector<std::optional<double>> p;
  for (const GroupContrast& one : contrasts) p.push_back(one.p);
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < contrasts.size(); ++i) contrasts[i].p_holm = adjusted[i];
}

}  // namespace

GroupContrast welch(const std::vector<double>& reference, const std::vector<double>& other) {
  GroupContrast out;
  out.n_reference = reference.size();
  out.n = other.size();
  if (reference.empty() || other.empty()) {
    out.undefined = "a group has no participant with a value in every cell";
    return out;
  }
  out.estimate = mean(other) - mean(reference);
  const auto a = standard_deviation(reference), b = standard_deviation(other);
  if (!a || !b) {
    out.undefined = "a group has one participant, so no variance";
    return out;
  }
  const auto m = static_cast<double>(reference.size()), n = static_cast<double>(other.size());
  const double va = *a * *a / m, vb = *b * *b / n;
  if (std::sqrt(va + vb) <= kNoVariance * std::max(1.0, std::fabs(mean(reference)))) {
    out.undefined = "all participants of a group are equal (no variance)";
    return out;
  }
  if (!std::isfinite(va * va + vb * vb)) {
    out.undefined = "numbers too large";
    return out;
  }
  out.se = std::sqrt(va + vb);
  out.df = (va + vb) * (va + vb) / (va * va / (m - 1) + vb * vb / (n - 1));
  out.t = *out.estimate / *out.se;
  out.p = 2 * cdf(complement(bm::students_t(*out.df), std::fabs(*out.t)));
  const double half = *out.se * quantile_975(*out.df);
  out.ci95 = Interval{*out.estimate - half, *out.estimate + half};
  return out;
}

BetweenGroups compare_groups(const std::vector<GroupedFigures>& figures, std::size_t groups,
                             const std::vector<WithinFactor>& within) {
  BetweenGroups out;
  std::vector<GroupedRow> rows;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    GroupedRow row{figures[i].group, {}};
    for (const std::optional<double>& value : figures[i].values) {
      if (value) row.values.push_back(*value);
    }
    if (row.values.size() == figures[i].values.size() && !row.values.empty())
      rows.push_back(std::move(row));
    else
      out.dropped.push_back(i);
  }
  out.anova = mixed_anova(rows, groups, within);
  const std::size_t conditions = within.empty() ? 1 : within.front().levels;
  std::vector<Compared> compared{{}};
  for (std::size_t c = 0; conditions > 1 && c < conditions; ++c) compared.push_back({c, false});
  for (std::size_t group = 0; group < groups; ++group) {
    for (const Compared& one : compared) {
      GroupMarginal& made =
          out.marginals.emplace_back(marginal(compared_values(rows, group, one, conditions)));
      made.group = group;
      made.condition = one.condition;
    }
  }
  for (std::size_t c = 1; c < conditions; ++c) compared.push_back({c, true});
  for (std::size_t group = 1; group < groups; ++group) {
    for (const Compared& one : compared) {
      GroupContrast& made =
          out.contrasts.emplace_back(welch(compared_values(rows, 0, one, conditions),
                                           compared_values(rows, group, one, conditions)));
      made.group = group;
      made.condition = one.condition;
      made.of_difference = one.of_difference;
    }
  }
  adjust_contrasts(out.contrasts);
  return out;
}

}  // namespace palpate::analysis
