#pragma once
// A hierarchical model of two coordinates per participant and condition, such as the location and
// log width of a psychometric function. Coordinates are normal over participants; likelihoods of
// answers are integrated over them on a grid. Intervals and p values are by the likelihood ratio
// with a limit that makes them the t interval when each participant's value is known exactly.

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Grid of a coordinate, and limits of its mean and of its SD between participants. One point: the
/// coordinate does not exist.
struct GroupAxis {
  double low = 0, high = 0;
  std::size_t points = 1;
  double least_sd = 1, most_sd = 1;

  double step() const { return (high - low) / static_cast<double>(points - 1); }
  double at(std::size_t i) const { return low + step() * static_cast<double>(i); }
};

/// Likelihood of a participant's answers in a condition, over its greatest value, where it matters.
struct GroupLikelihood {
  Eigen::MatrixXd values;  ///< rows: first coordinate, columns: second one; empty: no trials
  std::size_t first_row = 0, first_column = 0;  ///< in the grid
  double log_scale = 0;                         ///< log of the greatest value

  bool empty() const { return values.size() == 0; }
};

/// \param likelihood  on the whole grid, over exp(log_scale)
GroupLikelihood group_likelihood(const Eigen::MatrixXd& likelihood, double log_scale);

/// Likelihoods [setting][condition][participant]. Settings are what all participants share, such as
/// the mean of lapse rates; the best one is chosen.
struct GroupData {
  GroupAxis first, second;
  std::vector<std::vector<std::vector<GroupLikelihood>>> likelihoods;
};

enum class GroupCoordinate { first, second };

/// A mean of the group.
struct GroupMoments {
  double mean = 0, sd = 0;
  Interval ci95;  ///< an open end is at the edge of the grid
  bool low_open = false, high_open = false;
};

struct GroupCondition {
  std::size_t participants = 0;  ///< with trials
  GroupMoments first, second;
  double log_likelihood = 0;
};

struct GroupFit {
  std::size_t setting = 0;
  std::vector<double> log_likelihoods;  ///< of each setting, over all conditions
  std::vector<GroupCondition> conditions;
};

/// Each condition alone; they share the setting. \param intervals  false: estimates alone
GroupFit fit_group(const GroupData& data, bool intervals = true);

/// Value of t for a likelihood ratio LR = 2 (difference of log likelihoods) of n participants.
double group_t(double likelihood_ratio, std::size_t n);
/// Two-sided p with n - 1 degrees of freedom.
double group_p(double likelihood_ratio, std::size_t n);
/// The likelihood ratio at the ends of an interval. \param confidence  0.95, ...
double group_limit(std::size_t n, double confidence);

/// Where a likelihood ratio reaches `limit` on the way from its zero at `from` to `edge`.
/// \return none: it stays below up to the edge
std::optional<double> likelihood_ratio_end(const std::function<double(double)>& likelihood_ratio,
                                           double from, double edge, double first_step,
                                           double limit);

/// Difference of a coordinate between two conditions within participants: second minus first
/// condition. All eight parameters are free.
struct GroupDifference {
  std::size_t pairs = 0;  ///< participants with both conditions
  double difference = 0, middle = 0, sd_of_middle = 0, sd_of_difference = 0;
  GroupMoments other_first, other_second;  ///< the other coordinate; without intervals
  double log_likelihood = 0;
  double likelihood_ratio = 0, p = 1;  ///< of no difference
  std::optional<Interval> ci95;
  bool low_open = false, high_open = false;
  /// For equivalence, if it was asked for; an end at the edge of the box is open, as above.
  std::optional<Interval> ci90;
};

struct GroupDifferenceSettings {
  bool interval = true;
  bool interval90 = false;
  bool open_ends = false;  ///< without an interval: whether its ends are open
};

/// \param fit  of the same data; its setting is used \param conditions  reference and compared
GroupDifference compare_group(const GroupData& data, const GroupFit& fit,
                              GroupCoordinate coordinate, std::size_t reference,
                              std::size_t compared, const GroupDifferenceSettings& settings = {});

}  // namespace palpate::analysis
