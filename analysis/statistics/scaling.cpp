#include "analysis/statistics/scaling.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {
namespace {

/// 95 % interval of a mean by t; none below two values.
std::optional<Interval> mean_interval(const std::vector<double>& values) {
  const auto sd = standard_deviation(values);
  if (values.size() < 2 || !sd) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  const double half = quantile(boost::math::students_t(n - 1), 0.975) * *sd / std::sqrt(n);
  return Interval{mean(values) - half, mean(values) + half};
}

using LogsByLevel = std::map<double, std::vector<double>>;

StevensLine line_of(std::size_t participant, const LogsByLevel& logs) {
  StevensLine line;
  line.participant = participant;
  line.levels = logs.size();
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
  const auto n = static_cast<double>(logs.size());
  for (const auto& [level, values] : logs) {
    line.trials += values.size();
    mean_x += std::log10(level) / n;
    mean_y += mean(values) / n;
  }
  if (logs.size() < 2) {
    line.undefined = "fewer than two levels";
    return line;
  }
  for (const auto& [level, values] : logs) {
    const double x = std::log10(level) - mean_x, y = mean(values) - mean_y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  line.exponent = xy / xx;
  line.log10_scale = mean_y - *line.exponent * mean_x;
  if (yy > 0) line.r_squared = xy * xy / (xx * yy);
  if (logs.size() > 2)
    line.exponent_se = std::sqrt(std::max(0.0, yy - xy * xy / xx) / (n - 2) / xx);
  return line;
}

}  // namespace

MagnitudeEstimation magnitude_estimation(const std::vector<MagnitudeTrial>& trials, bool modulus) {
  MagnitudeEstimation result;
  std::map<std::size_t, LogsByLevel> by_participant;
  for (const MagnitudeTrial& trial : trials) {
    if (trial.level > 0 && trial.magnitude > 0) {
      by_participant[trial.participant][trial.level].push_back(std::log10(trial.magnitude));
    } else {
      ++result.without_logarithm;
    }
  }
  std::vector<double> exponents, centres;
  for (const auto& [participant, logs] : by_participant) {
    result.lines.push_back(line_of(participant, logs));
    if (result.lines.back().exponent) exponents.push_back(*result.lines.back().exponent);
    std::vector<double> means;
    for (const auto& [level, values] : logs) means.push_back(mean(values));
    centres.push_back(mean(means));
  }
  if (!exponents.empty()) result.exponent = mean(exponents);
  result.exponent_ci95 = mean_interval(exponents);

  std::map<double, std::vector<double>> by_level;
  std::size_t i = 0;
  for (const auto& [participant, logs] : by_participant) {
    const double shift = modulus ? 0 : mean(centres) - centres[i];
    ++i;
    for (const auto& [level, values] : logs) by_level[level].push_back(mean(values) + shift);
  }
  for (const auto& [level, values] : by_level) {
    MagnitudeMean one{level, std::pow(10, mean(values)), std::nullopt, values.size()};
    if (const auto ends = mean_interval(values))
      one.ci95 = Interval{std::pow(10, ends->low), std::pow(10, ends->high)};
    result.means.push_back(one);
  }
  return result;
}

std::vector<Adjustment> adjustments(const std::vector<AdjustmentTrial>& trials) {
  std::map<std::size_t, std::vector<AdjustmentTrial>> by_participant;
  for (const AdjustmentTrial& trial : trials) by_participant[trial.participant].push_back(trial);
  std::vector<Adjustment> results;
  for (const auto& [participant, own] : by_participant) {
    std::vector<double> all, above, below;
    for (const AdjustmentTrial& trial : own) {
      all.push_back(trial.setting);
      (trial.from_above ? above : below).push_back(trial.setting);
    }
    Adjustment result;
    result.participant = participant;
    result.settings = all.size();
    result.pse = mean(all);
    result.pse_ci95 = mean_interval(all);
    const bool all_above_zero = std::all_of(own.begin(), own.end(), [](const auto& trial) {
      return trial.setting > 0 && trial.standard > 0;
    });
    if (result.pse_ci95 && all_above_zero)
      result.pse_ci95->low = std::max(0.0, result.pse_ci95->low);
    result.constant_error = result.pse - own.front().standard;
    if (!above.empty() && !below.empty()) result.start_effect = mean(above) - mean(below);
    double squares = 0, df = 0;
    for (const auto* group : {&above, &below}) {
      if (group->empty()) continue;
      for (const double setting : *group) squares += std::pow(setting - mean(*group), 2);
      df += static_cast<double>(group->size()) - 1;
    }
    if (df > 0) {
      result.sd = std::sqrt(squares / df);
      result.jnd = 0.6744897501960817 * *result.sd;
    }
    results.push_back(result);
  }
  return results;
}

}  // namespace palpate::analysis
