#include "analysis/statistics/group_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/statistics/bounded_search.h"

namespace palpate::analysis {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A smaller part of the greatest likelihood does not matter.
constexpr double kLeastPart = 1e-20;
constexpr double kLeastIntegral = 1e-300;

// Parameters of a normal coordinate: its mean in units of an axis, and the log of its SD.

double unit_of(const GroupAxis& axis) { return 10 * axis.least_sd; }

/// Trapezoid weights of a normal coordinate with derivatives by both parameters.
struct Weights {
  VectorXd value, by_mean, by_log_sd;
};

VectorXd trapezoid(const GroupAxis& axis) {
  VectorXd weights = VectorXd::Ones(static_cast<Index>(axis.points));
  if (axis.points == 1) return weights;
  weights *= axis.step();
  weights[0] /= 2;
  weights[weights.size() - 1] /= 2;
  return weights;
}

constexpr double kRootTwoPi = 2.5066282746310002;

Weights weights_of(const GroupAxis& axis, double scaled_mean, double log_sd) {
  Weights out;
  out.value = trapezoid(axis);
  const Index n = out.value.size();
  out.by_mean = out.by_log_sd = VectorXd::Zero(n);
  if (axis.points == 1) return out;
  const double sd = std::exp(log_sd), mean = scaled_mean * unit_of(axis);
  const ArrayXd z = (ArrayXd::LinSpaced(n, axis.low, axis.high) - mean) / sd;
  out.value.array() *= (-0.5 * z.square()).exp() / (kRootTwoPi * sd);
  out.by_mean = out.value.array() * z * (unit_of(axis) / sd);
  out.by_log_sd = out.value.array() * (z.square() - 1);
  return out;
}

void put_bounds(const GroupAxis& axis, Bounds& bounds, Index mean, Index log_sd) {
  bounds.low[mean] = axis.low / unit_of(axis);
  bounds.high[mean] = axis.high / unit_of(axis);
  bounds.low[log_sd] = std::log(axis.least_sd);
  bounds.high[log_sd] = std::log(axis.most_sd);
}

using Likelihoods = std::vector<GroupLikelihood>;

// One condition: parameters (mean, log SD) of the first and of the second coordinate.

struct SingleObjective {
  const GroupData& data;
  const Likelihoods& participants;

  double operator()(const VectorXd& x, VectorXd& gradient) const {
    const Weights rows = weights_of(data.first, x[0], x[1]);
    const Weights columns = weights_of(data.second, x[2], x[3]);
    double sum = 0;
    gradient.setZero();
    for (const GroupLikelihood& one : participants) {
      if (one.empty()) continue;
      const auto row = static_cast<Index>(one.first_row), n_rows = one.values.rows();
      const auto column = static_cast<Index>(one.first_column), n_columns = one.values.cols();
      const VectorXd a = one.values * columns.value.segment(column, n_columns);
      const double integral = rows.value.segment(row, n_rows).dot(a);
      sum -= std::log(std::max(integral, kLeastIntegral)) + one.log_scale;
      if (!(integral > kLeastIntegral)) continue;
      const VectorXd b = one.values.transpose() * rows.value.segment(row, n_rows);
      gradient[0] -= rows.by_mean.segment(row, n_rows).dot(a) / integral;
      gradient[1] -= rows.by_log_sd.segment(row, n_rows).dot(a) / integral;
      gradient[2] -= columns.by_mean.segment(column, n_columns).dot(b) / integral;
      gradient[3] -= columns.by_log_sd.segment(column, n_columns).dot(b) / integral;
    }
    return sum;
  }
};

Bounds single_bounds(const GroupData& data) {
  Bounds bounds{VectorXd(4), VectorXd(4)};
  put_bounds(data.first, bounds, 0, 1);
  put_bounds(data.second, bounds, 2, 3);
  return bounds;
}

struct SpreadOverPeople {
  double mean = 0, sd = 0;
};

/// Of the participants' means of the coordinate under a flat prior.
SpreadOverPeople spread_of_means(const GroupData& data, const Likelihoods& participants,
                                 bool first) {
  const GroupAxis& axis = first ? data.first : data.second;
  if (axis.points == 1) return {};
  double n = 0, sum = 0, squares = 0;
  for (const GroupLikelihood& one : participants) {
    if (one.empty()) continue;
    const VectorXd mass = first ? VectorXd(one.values.rowwise().sum())
                                : VectorXd(one.values.colwise().sum().transpose());
    const std::size_t start = first ? one.first_row : one.first_column;
    double mean = 0;
    for (Index i = 0; i < mass.size(); ++i)
      mean += mass[i] * axis.at(start + static_cast<std::size_t>(i)) / mass.sum();
    n += 1;
    sum += mean;
    squares += mean * mean;
  }
  if (n == 0) return {(axis.low + axis.high) / 2, 0};
  return {sum / n, std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)))};
}

std::vector<VectorXd> single_starts(const GroupData& data, const Likelihoods& participants) {
  const SpreadOverPeople first = spread_of_means(data, participants, true);
  const SpreadOverPeople second = spread_of_means(data, participants, false);
  const auto start = [&](double first_sd, double second_sd) {
    VectorXd x(4);
    x << first.mean / unit_of(data.first), std::log(first_sd), second.mean / unit_of(data.second),
        std::log(second_sd);
    return x;
  };
  return {start(1.5 * data.first.least_sd, 1.5 * data.second.least_sd),
          start(4 * data.first.least_sd, 4 * data.second.least_sd),
          start(std::max(first.sd, 2 * data.first.least_sd),
                std::max(second.sd, 2 * data.second.least_sd))};
}

/// Fits of a condition with each setting; settings too unlikely are left out.
struct SettingFits {
  std::vector<std::vector<Minimum>> of;  ///< [condition][setting]
  std::vector<double> total;             ///< minus log likelihood of each setting
  std::size_t best = 0;

  /// Likelihood of the other conditions at a setting.
  double others(std::size_t condition, std::size_t setting) const {
    return total[setting] - of[condition][setting].value;
  }
};

/// Settings less likely than the best by more (in log units) do not matter for an interval.
constexpr double kUnlikely = 6;

SettingFits fits_of_settings(const GroupData& data) {
  SettingFits fits;
  const std::size_t settings = data.likelihoods.size(), conditions = data.likelihoods[0].size();
  fits.of.resize(conditions);
  fits.total.assign(settings, 0);
  const Bounds bounds = single_bounds(data);
  for (std::size_t s = 0; s < settings; ++s) {
    for (std::size_t c = 0; c < conditions; ++c) {
      const Likelihoods& participants = data.likelihoods[s][c];
      std::vector<VectorXd> starts = single_starts(data, participants);
      if (s > 0) starts.push_back(fits.of[c][s - 1].place);
      fits.of[c].push_back(best_of(SingleObjective{data, participants}, starts, bounds));
      fits.total[s] += fits.of[c][s].value;
    }
  }
  const auto least = std::min_element(fits.total.begin(), fits.total.end());
  fits.best = static_cast<std::size_t>(least - fits.total.begin());
  return fits;
}

/// Twice the loss of log likelihood with the mean of a coordinate held, over all settings.
class SingleProfile {
 public:
  SingleProfile(const GroupData& data, const SettingFits& fits, std::size_t condition, bool first)
      : data_(data), fits_(fits), condition_(condition), index_(first ? 0 : 2) {
    restart();
  }

  /// Begins again at the fit.
  void restart() {
    last_.clear();
    for (const Minimum& one : fits_.of[condition_]) last_.push_back(one.place);
  }

  /// \param mean  in units of the axis
  double operator()(double mean) {
    double best = std::numeric_limits<double>::infinity();
    Bounds bounds = single_bounds(data_);
    bounds.low[index_] = bounds.high[index_] = mean;
    for (std::size_t s = 0; s < last_.size(); ++s) {
      if (fits_.total[s] > fits_.total[fits_.best] + kUnlikely) continue;
      const SingleObjective objective{data_, data_.likelihoods[s][condition_]};
      VectorXd wide = fits_.of[condition_][s].place;
      const GroupAxis& axis = index_ == 0 ? data_.first : data_.second;
      wide[index_ + 1] =
          std::log(std::max(4 * axis.least_sd, std::abs(mean - wide[index_]) * unit_of(axis)));
      const Minimum found = best_of(objective, {last_[s], wide}, bounds);
      last_[s] = found.place;
      best = std::min(best, found.value + fits_.others(condition_, s));
    }
    return 2 * (best - fits_.total[fits_.best]);
  }

 private:
  const GroupData& data_;
  const SettingFits& fits_;
  std::size_t condition_;
  Index index_;
  std::vector<VectorXd> last_;
};

/// Within so many of the least SDs from the edge, a part of the normal lies beyond it: the loss of
/// likelihood there is no evidence, and an end of an interval is open.
constexpr double kEdgeFloors = 2.5;

GroupMoments moments_of(const GroupData& data, const SettingFits& fits, std::size_t condition,
                        bool first, std::size_t n, bool interval) {
  GroupMoments out;
  const GroupAxis& axis = first ? data.first : data.second;
  if (axis.points == 1) return out;
  const VectorXd& place = fits.of[condition][fits.best].place;
  const double unit = unit_of(axis), at = place[first ? 0 : 2];
  out.mean = at * unit;
  out.sd = std::exp(place[first ? 1 : 3]);
  out.ci95 = {axis.low, axis.high};
  out.low_open = out.high_open = true;
  if (!interval || n < 3) return out;
  const double limit = group_limit(n, 0.95);
  SingleProfile profile(data, fits, condition, first);
  const double step = 2 * out.sd / std::sqrt(static_cast<double>(n)) / unit;
  const auto end = [&](double edge) {
    profile.restart();
    return likelihood_ratio_end([&](double mean) { return profile(mean); }, at, edge / unit, step,
                                limit);
  };
  const auto low = end(axis.low), high = end(axis.high);
  if (low && *low * unit > axis.low + kEdgeFloors * axis.least_sd) {
    out.ci95.low = *low * unit;
    out.low_open = false;
  }
  if (high && *high * unit < axis.high - kEdgeFloors * axis.least_sd) {
    out.ci95.high = *high * unit;
    out.high_open = false;
  }
  return out;
}

// Two conditions: y1 = a - d/2 and y2 = a + d/2 of the compared coordinate, a and d normal.
// Parameters: mean and log SD of a, of d, and of the other coordinate in both conditions.

/// Likelihoods with the compared coordinate in rows.
struct PairedLikelihood {
  GroupLikelihood first, second;
};

GroupLikelihood turned(const GroupLikelihood& one) {
  return {one.values.transpose(), one.first_column, one.first_row, one.log_scale};
}

class PairObjective {
 public:
  PairObjective(const GroupData& data, std::size_t setting, GroupCoordinate coordinate,
                std::size_t reference, std::size_t compared)
      : axis_(coordinate == GroupCoordinate::first ? data.first : data.second),
        other_(coordinate == GroupCoordinate::first ? data.second : data.first),
        areas_(trapezoid(axis_)) {
    const auto& of = data.likelihoods[setting];
    for (std::size_t i = 0; i < of[reference].size(); ++i) {
      PairedLikelihood both{of[reference][i], of[compared][i]};
      if (coordinate == GroupCoordinate::second) both = {turned(both.first), turned(both.second)};
      if (both.first.empty() && both.second.empty()) continue;
      pairs_ += !both.first.empty() && !both.second.empty() ? 1 : 0;
      participants_.push_back(std::move(both));
    }
    const auto n = static_cast<Index>(axis_.points);
    places_ = VectorXd::LinSpaced(n, axis_.low, axis_.high);
  }

  const GroupAxis& axis() const { return axis_; }
  const GroupAxis& other() const { return other_; }
  std::size_t pairs() const { return pairs_; }

  Bounds bounds() const {
    Bounds out{VectorXd(8), VectorXd(8)};
    put_bounds(axis_, out, 0, 1);
    put_bounds(axis_, out, 2, 3);
    const double width = (axis_.high - axis_.low) / unit_of(axis_);
    out.low[2] = -width;
    out.high[2] = width;
    put_bounds(other_, out, 4, 5);
    put_bounds(other_, out, 6, 7);
    return out;
  }

  double operator()(const VectorXd& x, VectorXd& gradient) const {
    const Normals normals = normals_of(x);
    const std::array others{weights_of(other_, x[4], x[5]), weights_of(other_, x[6], x[7])};
    double sum = 0;
    gradient.setZero();
    for (const PairedLikelihood& one : participants_) {
      VectorXd part = VectorXd::Zero(8);
      const double integral = !one.first.empty() && !one.second.empty()
                                  ? both(one, normals, others, part)
                                  : alone(one, normals, others, part);
      sum -=
          std::log(std::max(integral, kLeastIntegral)) + one.first.log_scale + one.second.log_scale;
      if (integral > kLeastIntegral) gradient -= part / integral;
    }
    return sum;
  }

 private:
  struct Normals {
    double middle, tau, difference, omega;
    ArrayXd of_middle, of_difference;  ///< densities at j + k, and at k - j + points - 1
  };

  Normals normals_of(const VectorXd& x) const {
    Normals out{
        x[0] * unit_of(axis_), std::exp(x[1]), x[2] * unit_of(axis_), std::exp(x[3]), {}, {}};
    const auto size = static_cast<Index>(2 * axis_.points - 1);
    const double width = axis_.high - axis_.low;
    const auto density = [](const ArrayXd& values, double mean, double sd) {
      return ArrayXd((-0.5 * ((values - mean) / sd).square()).exp() / (kRootTwoPi * sd));
    };
    out.of_middle = density(ArrayXd::LinSpaced(size, axis_.low, axis_.high), out.middle, out.tau);
    out.of_difference = density(ArrayXd::LinSpaced(size, -width, width), out.difference, out.omega);
    return out;
  }

  /// Mass of the compared coordinate at the rows of a likelihood.
  VectorXd masses(const GroupLikelihood& one, const Weights& other) const {
    const auto row = static_cast<Index>(one.first_row);
    const auto column = static_cast<Index>(one.first_column);
    return areas_.segment(row, one.values.rows())
        .cwiseProduct(one.values * other.value.segment(column, one.values.cols()));
  }

  /// Derivatives by the parameters of the other coordinate. \param by_mass  those by the masses
  void add_other(const GroupLikelihood& one, const Weights& other, const VectorXd& by_mass,
                 VectorXd& part, Index index) const {
    if (other_.points == 1) return;
    const auto row = static_cast<Index>(one.first_row);
    const auto column = static_cast<Index>(one.first_column), n = one.values.cols();
    const VectorXd by_weight =
        one.values.transpose() * areas_.segment(row, by_mass.size()).cwiseProduct(by_mass);
    part[index] = by_weight.dot(other.by_mean.segment(column, n));
    part[index + 1] = by_weight.dot(other.by_log_sd.segment(column, n));
  }

  double both(const PairedLikelihood& one, const Normals& normals,
              const std::array<Weights, 2>& others, VectorXd& part) const {
    const VectorXd first = masses(one.first, others[0]), second = masses(one.second, others[1]);
    const auto row = static_cast<Index>(one.first.first_row);
    const auto column = static_cast<Index>(one.second.first_row);
    const auto points = static_cast<Index>(axis_.points);
    MatrixXd joint(first.size(), second.size());
    for (Index k = 0; k < second.size(); ++k) {
      joint.col(k) = normals.of_middle.segment(row + column + k, first.size()) *
                     normals.of_difference
                         .segment(column + k - row - first.size() + 1 + points - 1, first.size())
                         .reverse();
    }
    const VectorXd y1 = places_.segment(row, first.size()).array() - normals.middle;
    const VectorXd y2 = places_.segment(column, second.size()).array() - normals.middle;
    const VectorXd by_first = joint * second, by_second = joint.transpose() * first;
    const VectorXd a = first.cwiseProduct(by_first), b = second.cwiseProduct(by_second);
    const double s = a.sum(), m10 = a.dot(y1), m01 = b.dot(y2), m20 = a.dot(y1.cwiseProduct(y1)),
                 m02 = b.dot(y2.cwiseProduct(y2)),
                 m11 = first.cwiseProduct(y1).dot(joint * second.cwiseProduct(y2));
    const double tau2 = normals.tau * normals.tau, omega2 = normals.omega * normals.omega;
    const double d = normals.difference;
    part[0] = (m10 + m01) / 2 / tau2 * unit_of(axis_);
    part[1] = (m20 + 2 * m11 + m02) / 4 / tau2 - s;
    part[2] = (m01 - m10 - d * s) / omega2 * unit_of(axis_);
    part[3] = (m20 - 2 * m11 + m02 - 2 * d * (m01 - m10) + d * d * s) / omega2 - s;
    add_other(one.first, others[0], by_first, part, 4);
    add_other(one.second, others[1], by_second, part, 6);
    return s;
  }

  double alone(const PairedLikelihood& one, const Normals& normals,
               const std::array<Weights, 2>& others, VectorXd& part) const {
    const bool is_first = one.second.empty();
    const GroupLikelihood& own = is_first ? one.first : one.second;
    const Weights& other = others[is_first ? 0 : 1];
    const double half = is_first ? -0.5 : 0.5;
    const double variance = normals.tau * normals.tau + normals.omega * normals.omega / 4;
    const VectorXd mass = masses(own, other);
    const ArrayXd y = places_.segment(static_cast<Index>(own.first_row), mass.size()).array() -
                      normals.middle - half * normals.difference;
    const VectorXd density =
        (-0.5 * y.square() / variance).exp() / (kRootTwoPi * std::sqrt(variance));
    const ArrayXd joint = mass.cwiseProduct(density).array();
    const double s = joint.sum(), by_mean = (joint * y).sum() / variance;
    const double by_variance = ((joint * y.square()).sum() / variance - s) / (2 * variance);
    part[0] = by_mean * unit_of(axis_);
    part[2] = half * by_mean * unit_of(axis_);
    part[1] = by_variance * 2 * normals.tau * normals.tau;
    part[3] = by_variance * normals.omega * normals.omega / 2;
    add_other(own, other, density, part, is_first ? 4 : 6);
    return s;
  }

  GroupAxis axis_, other_;
  VectorXd areas_, places_;
  std::vector<PairedLikelihood> participants_;
  std::size_t pairs_ = 0;
};

/// Fits of pairs, with any difference held.
class PairProfile {
 public:
  PairProfile(const GroupData& data, const GroupFit& fit, GroupCoordinate coordinate,
              std::size_t reference, std::size_t compared)
      : objective_(data, fit.setting, coordinate, reference, compared) {
    const bool is_first = coordinate == GroupCoordinate::first;
    const GroupCondition &a = fit.conditions[reference], &b = fit.conditions[compared];
    const GroupMoments &y1 = is_first ? a.first : a.second, &y2 = is_first ? b.first : b.second;
    const GroupMoments &o1 = is_first ? a.second : a.first, &o2 = is_first ? b.second : b.first;
    const double unit = unit_of(objective_.axis()), least = objective_.axis().least_sd;
    const double other_unit = unit_of(objective_.other()),
                 other_least = objective_.other().least_sd;
    const auto start = [&](double tau, double omega, double other1, double other2) {
      VectorXd x(8);
      x << (y1.mean + y2.mean) / 2 / unit, std::log(tau), (y2.mean - y1.mean) / unit,
          std::log(omega), o1.mean / other_unit, std::log(other1), o2.mean / other_unit,
          std::log(other2);
      return x;
    };
    std::vector<VectorXd> starts;
    for (const double tau : {2.0, 6.0}) {
      for (const double omega : {2.0, 8.0}) {
        for (const double other : {1.5, 4.0})
          starts.push_back(
              start(tau * least, omega * least, other * other_least, other * other_least));
      }
    }
    const double spread = std::max({y1.sd, y2.sd, 2 * least});
    starts.push_back(
        start(spread, spread / 2, std::max(o1.sd, other_least), std::max(o2.sd, other_least)));
    best_ = best_of(std::cref(objective_), starts, objective_.bounds());
    restart();
  }

  const PairObjective& objective() const { return objective_; }
  const Minimum& best() const { return best_; }
  void restart() { last_ = best_.place; }

  /// \param difference  in its own unit
  double operator()(double difference) {
    const double held = difference / unit_of(objective_.axis());
    Bounds bounds = objective_.bounds();
    bounds.low[2] = bounds.high[2] = held;
    const double least = objective_.axis().least_sd, most = objective_.axis().most_sd;
    const double moved = std::abs(difference - best_.place[2] * unit_of(objective_.axis()));
    VectorXd wide = best_.place, narrow = last_;
    wide[3] = std::log(std::clamp(std::max(moved, 4 * least), least, most));
    narrow[1] = std::max(narrow[1], std::log(4 * least));
    narrow[3] = std::log(2 * least);
    const Minimum found = best_of(std::cref(objective_), {last_, wide, narrow}, bounds);
    last_ = found.place;
    // A better maximum found on the way.
    return std::max(0.0, 2 * (found.value - best_.value));
  }

 private:
  PairObjective objective_;
  Minimum best_;
  VectorXd last_;
};

/// Whether nothing determines an end of a difference, because an end of a condition is open.
void put_open_ends(const GroupFit& fit, GroupCoordinate coordinate, std::size_t reference,
                   std::size_t compared, GroupDifference& out) {
  const auto of = [&](std::size_t c) {
    return coordinate == GroupCoordinate::first ? fit.conditions[c].first
                                                : fit.conditions[c].second;
  };
  out.low_open |= of(compared).low_open || of(reference).high_open;
  out.high_open |= of(compared).high_open || of(reference).low_open;
}

}  // namespace

GroupLikelihood group_likelihood(const MatrixXd& likelihood, double log_scale) {
  GroupLikelihood out;
  const double greatest = likelihood.maxCoeff();
  out.log_scale = log_scale + std::log(greatest);
  const MatrixXd values = likelihood / greatest;
  const VectorXd rows = values.rowwise().maxCoeff(), columns = values.colwise().maxCoeff();
  const auto range = [](const VectorXd& most) {
    Index low = 0, high = most.size() - 1;
    while (most[low] < kLeastPart) ++low;
    while (most[high] < kLeastPart) --high;
    return std::pair{low, high - low + 1};
  };
  const auto [row, n_rows] = range(rows);
  const auto [column, n_columns] = range(columns);
  out.first_row = static_cast<std::size_t>(row);
  out.first_column = static_cast<std::size_t>(column);
  out.values = values.block(row, column, n_rows, n_columns);
  return out;
}

double group_t(double likelihood_ratio, std::size_t n) {
  const auto count = static_cast<double>(n);
  return std::sqrt((count - 1) * std::expm1(std::max(0.0, likelihood_ratio) / count));
}

double group_p(double likelihood_ratio, std::size_t n) {
  const boost::math::students_t t(static_cast<double>(n) - 1);
  return 2 * cdf(complement(t, group_t(likelihood_ratio, n)));
}

double group_limit(std::size_t n, double confidence) {
  const auto count = static_cast<double>(n);
  const double t = quantile(boost::math::students_t(count - 1), 0.5 + confidence / 2);
  return count * std::log1p(t * t / (count - 1));
}

std::optional<double> likelihood_ratio_end(const std::function<double(double)>& likelihood_ratio,
                                           double from, double edge, double first_step,
                                           double limit) {
  const double side = edge > from ? 1 : -1, most = std::abs(edge - from);
  const auto excess = [&](double distance) {
    return std::sqrt(std::max(0.0, likelihood_ratio(from + side * distance))) - std::sqrt(limit);
  };
  double low = 0, at_low = -std::sqrt(limit), high = std::min(first_step, most), at_high = 0;
  if (most == 0) return std::nullopt;
  for (;;) {
    at_high = excess(high);
    if (at_high > 0) break;
    if (high >= most) return std::nullopt;
    const double slope = (at_high + std::sqrt(limit)) / high;
    const double guess = slope > 0 ? 1.1 * std::sqrt(limit) / slope : 0;
    low = high;
    at_low = at_high;
    high = std::min(most, std::clamp(guess, 1.15 * high, 3 * high));
  }
  // Ridders' relative of false position that halves a stuck end (Dowell & Jarratt 1971).
  int stuck = 0;
  for (int i = 0; i < 60 && high - low > 1e-9 * most; ++i) {
    const double middle = (low * at_high - high * at_low) / (at_high - at_low);
    const double value = excess(middle);
    if (std::abs(value) < 1e-9) return from + side * middle;
    if (value > 0) {
      high = middle;
      at_high = value;
      at_low *= stuck == 1 ? 0.5 : 1;
      stuck = 1;
    } else {
      low = middle;
      at_low = value;
      at_high *= stuck == -1 ? 0.5 : 1;
      stuck = -1;
    }
  }
  return from + side * 0.5 * (low + high);
}

GroupFit fit_group(const GroupData& data, bool intervals) {
  GroupFit out;
  const SettingFits fits = fits_of_settings(data);
  out.setting = fits.best;
  for (const double total : fits.total) out.log_likelihoods.push_back(-total);
  for (std::size_t c = 0; c < fits.of.size(); ++c) {
    GroupCondition one;
    one.participants = static_cast<std::size_t>(std::ranges::count_if(
        data.likelihoods[fits.best][c], [](const GroupLikelihood& own) { return !own.empty(); }));
    one.log_likelihood = -fits.of[c][fits.best].value;
    one.first = moments_of(data, fits, c, true, one.participants, intervals);
    one.second = moments_of(data, fits, c, false, one.participants, intervals);
    out.conditions.push_back(one);
  }
  return out;
}

GroupDifference compare_group(const GroupData& data, const GroupFit& fit,
                              GroupCoordinate coordinate, std::size_t reference,
                              std::size_t compared, const GroupDifferenceSettings& settings) {
  GroupDifference out;
  PairProfile profile(data, fit, coordinate, reference, compared);
  const GroupAxis& axis = profile.objective().axis();
  const GroupAxis& other = profile.objective().other();
  const VectorXd& x = profile.best().place;
  out.pairs = profile.objective().pairs();
  out.middle = x[0] * unit_of(axis);
  out.sd_of_middle = std::exp(x[1]);
  out.difference = x[2] * unit_of(axis);
  out.sd_of_difference = std::exp(x[3]);
  out.other_first = {x[4] * unit_of(other), std::exp(x[5]), {}, false, false};
  out.other_second = {x[6] * unit_of(other), std::exp(x[7]), {}, false, false};
  out.log_likelihood = -profile.best().value;
  if (out.pairs < 3) return out;
  out.likelihood_ratio = profile(0);
  out.p = group_p(out.likelihood_ratio, out.pairs);
  const double width = axis.high - axis.low;
  if (!settings.interval && settings.open_ends) {
    const double limit = group_limit(out.pairs, 0.95);
    profile.restart();
    out.low_open = profile(-width) < limit;
    profile.restart();
    out.high_open = profile(width) < limit;
  }
  if (!settings.interval) return out;
  const double step = 2 * std::hypot(out.sd_of_difference, axis.least_sd) /
                      std::sqrt(static_cast<double>(out.pairs));
  const auto end_of = [&](bool low, double confidence) {
    profile.restart();
    return likelihood_ratio_end([&](double d) { return profile(d); }, out.difference,
                                low ? -width : width, step, group_limit(out.pairs, confidence));
  };
  out.ci95 = Interval{-width, width};
  for (const bool low : {true, false}) {
    const auto end = end_of(low, 0.95);
    (low ? out.low_open : out.high_open) = !end;
    if (end) (low ? out.ci95->low : out.ci95->high) = *end;
  }
  put_open_ends(fit, coordinate, reference, compared, out);
  if (settings.interval90)
    out.ci90 = Interval{end_of(true, 0.9).value_or(-width), end_of(false, 0.9).value_or(width)};
  return out;
}

}  // namespace palpate::analysis
