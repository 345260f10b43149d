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

/// The value of a participant to be compared.
struct Compared {
  std::optional<DesignCondition> condition;  ///< none: the mean over all cells
  bool of_difference = false;
};

/// Values of a group's participants.
std::vector<double> compared_values(const std::vector<GroupedRow>& rows, std::size_t group,
                                    const Compared& what, const std::vector<WithinFactor>& within) {
  std::vector<double> out;
  for (const GroupedRow& row : rows) {
    if (row.group != group) continue;
    double value =
        what.condition ? mean_of_condition(row.values, within, *what.condition) : mean(row.values);
    if (what.of_difference)
      value -= mean_of_condition(row.values, within, {what.condition->factor, 0});
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

/// One-sample t of the participants' differences.
GroupContrast paired_contrast(const std::vector<double>& differences, double noise) {
  GroupContrast out;
  out.within = out.of_difference = true;
  out.n_reference = out.n = differences.size();
  const GroupMarginal found = marginal(differences);
  out.estimate = found.mean;
  if (!found.mean || !found.se) {
    out.undefined = "fewer than two participants with a value in every cell";
    return out;
  }
  if (*found.se <= std::max(noise, kNoVariance * std::max(1.0, std::fabs(*found.mean)))) {
    out.undefined = "all participants of a group are equal (no variance)";
    return out;
  }
  out.se = found.se;
  out.ci95 = found.ci95;
  out.df = static_cast<double>(differences.size()) - 1;
  out.t = *out.estimate / *out.se;
  out.p = 2 * cdf(complement(bm::students_t(*out.df), std::fabs(*out.t)));
  return out;
}

}  // namespace

ComparedConditions compared_conditions(const std::vector<WithinFactor>& within, std::size_t shown) {
  ComparedConditions out{{std::nullopt}, {}};
  for (std::size_t f = 0; f < std::min(shown, within.size()); ++f) {
    if (within[f].levels < 2) continue;
    for (std::size_t level = 0; level < within[f].levels; ++level) {
      out.means.emplace_back(DesignCondition{f, level});
      if (level > 0) out.differences.push_back({f, level});
    }
  }
  return out;
}

void adjust_contrasts(std::vector<GroupContrast>& contrasts) {
  for (const bool within : {false, true}) {
    std::vector<std::optional<double>> p;
    for (const GroupContrast& one : contrasts)
      p.push_back(one.within == within ? one.p : std::nullopt);
    const auto adjusted = holm(p);
    for (std::size_t i = 0; i < contrasts.size(); ++i) {
      if (contrasts[i].within == within) contrasts[i].p_holm = adjusted[i];
    }
  }
}

GroupContrast welch(const std::vector<double>& reference, const std::vector<double>& other,
                    double noise) {
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
  if (std::sqrt(va + vb) <=
      std::max(noise, kNoVariance * std::max(1.0, std::fabs(mean(reference))))) {
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

double mean_of_condition(const std::vector<double>& cells, const std::vector<WithinFactor>& within,
                         const DesignCondition& condition) {
  std::size_t inner = 1;  // cells from one level of the factor to the next
  for (std::size_t f = condition.factor + 1; f < within.size(); ++f) inner *= within[f].levels;
  double sum = 0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i / inner % within[condition.factor].levels != condition.level) continue;
    sum += cells[i];
    ++n;
  }
  return sum / static_cast<double>(n);
}

BetweenGroups compare_groups(const std::vector<GroupedFigures>& figures, std::size_t groups,
                             const std::vector<WithinFactor>& within, WithinContrasts contrasts) {
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
  const double noise = figure_noise(rows);
  // Shapes are described by themselves: one table for each would hide the design.
  const ComparedConditions conditions =
      compared_conditions(within, contrasts == WithinContrasts::added ? within.size() : 1);
  std::vector<Compared> compared, differences;
  for (const auto& condition : conditions.means) compared.push_back({condition, false});
  for (const DesignCondition& condition : conditions.differences)
    differences.push_back({condition, true});
  for (std::size_t group = 0; group < groups; ++group) {
    for (const Compared& one : compared) {
      GroupMarginal& made =
          out.marginals.emplace_back(marginal(compared_values(rows, group, one, within)));
      made.group = group;
      made.condition = one.condition;
    }
  }
  compared.insert(compared.end(), differences.begin(), differences.end());
  for (std::size_t group = 1; group < groups; ++group) {
    for (const Compared& one : compared) {
      GroupContrast& made = out.contrasts.emplace_back(welch(
          compared_values(rows, 0, one, within), compared_values(rows, group, one, within), noise));
      made.group = group;
      made.condition = one.condition;
      made.of_difference = one.of_difference;
    }
  }
  for (std::size_t group = 0; contrasts == WithinContrasts::added && group < groups; ++group) {
    for (const Compared& one : differences) {
      GroupContrast& made = out.contrasts.emplace_back(
          paired_contrast(compared_values(rows, group, one, within), noise));
      made.group = group;
      made.condition = one.condition;
    }
  }
  adjust_contrasts(out.contrasts);
  return out;
}

}  // namespace palpate::analysis
