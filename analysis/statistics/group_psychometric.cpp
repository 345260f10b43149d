#include "analysis/statistics/group_psychometric.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "analysis/statistics/normal_tail.h"

namespace palpate::analysis {
namespace {

using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::Index;
using Eigen::MatrixXd;
using protocols::PsychometricShape;

constexpr double kLeastProbability = 1e-12;

/// A rate that differs between participants: exponential, cut at the last node.
struct RateNodes {
  std::vector<double> nodes, means;

  /// Trapezoid weights for a mean.
  std::vector<double> weights(double mean) const {
    std::vector<double> out(nodes.size(), 1);
    if (nodes.size() == 1) return out;
    double sum = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const double below = i == 0 ? nodes[0] : nodes[i - 1];
      const double above = i + 1 == nodes.size() ? nodes[i] : nodes[i + 1];
      out[i] = (above - below) / 2 * std::exp(-nodes[i] / mean);
      sum += out[i];
    }
    for (double& weight : out) weight /= sum;
    return out;
  }
};

const RateNodes& lapses_alone() {
  static const RateNodes rates{{0, .005, .01, .02, .03, .04, .06, .08, .10},
                               {.002, .005, .01, .02, .04, .1}};
  return rates;
}

/// Yes/no: lapses and guesses are crossed.
const RateNodes& lapses_with_guesses() {
  static const RateNodes rates{{0, .01, .03, .06, .10}, {.002, .01, .03, .1}};
  return rates;
}

const RateNodes& guesses_of_yes_no() {
  static const RateNodes rates{{0, .02, .05, .1, .15, .2, .3, .4}, {.02, .05, .1, .2}};
  return rates;
}

/// Rates of a model; one node of 0 stands for "none of its own".
struct Rates {
  const RateNodes& lapse;
  RateNodes guess;
};

Rates rates_of(const GroupPsychometricModel& model) {
  if (model.asymptotes == GroupAsymptotes::own_guess)
    return {lapses_with_guesses(), guesses_of_yes_no()};
  return {lapses_alone(), {{0}, {1}}};
}

/// Place of a level: rising towards the easier ones.
double place_of(const GroupPsychometricModel& model, double level) {
  const bool linear = model.function.scale == protocols::LevelScale::linear;
  const double place = linear ? level : std::log(level);
  return model.function.easier == protocols::Easier::higher ? place : -place;
}

/// Places of the locations of a grid.
ArrayXd places_of(const GroupPsychometricModel& model, const ArrayXd& locations) {
  if (!model.standard) return locations;
  const double side = model.function.easier == protocols::Easier::higher ? 1 : -1;
  // Below a standard above 0, no level reaches 0.
  constexpr double kLeastLevel = 1e-9;
  const double standard = *model.standard;
  return locations.exp().unaryExpr([&](double distance) {
    const double level = standard + side * distance;
    const bool linear = model.function.scale == protocols::LevelScale::linear;
    return place_of(model, linear ? level : std::max(level, kLeastLevel * standard));
  });
}

/// Share of successes without guesses and lapses. \param z  distance from the location in widths,
/// half the distance of the levels of 25 and 75 %
ArrayXd shares(PsychometricShape shape, const ArrayXd& z) {
  if (shape == PsychometricShape::logistic) return (1 + (-std::log(3.0) * z).exp()).inverse();
  if (shape == PsychometricShape::normal) {
    return z.unaryExpr(
        [](double one) { return 0.5 * std::erfc(-kNormal75 * one / std::sqrt(2.0)); });
  }
  static const double low = std::log(-std::log(0.75)), high = std::log(std::log(4.0));
  return -((0.5 * (high - low) * z + 0.5 * (high + low)).exp().unaryExpr([](double hazard) {
    return std::expm1(-hazard);
  }));
}

struct Axes {
  GroupAxis location, width;
};

/// Log likelihoods of a participant on the grid: sums over levels, products of few trials by
/// powers.
class LogLikelihood {
 public:
  explicit LogLikelihood(Index cells)
      : sum_(ArrayXd::Zero(cells)), product_(ArrayXd::Ones(cells)) {}

  void add(const ArrayXd& p, int successes, int failures) {
    const ArrayXd clamped = p.max(kLeastProbability).min(1 - kLeastProbability);
    if (successes > 0) multiply(clamped, successes);
    if (failures > 0) multiply(1 - clamped, failures);
  }

  ArrayXd value() {
    flush();
    return sum_;
  }

 private:
  static constexpr int kMostFactors = 24;  // 1e-12^24 is still a number

  void multiply(const ArrayXd& p, int times) {
    if (times > kMostFactors) {
      sum_ += times * p.log();
      return;
    }
    if (factors_ + times > kMostFactors) flush();
    factors_ += times;
    ArrayXd power = p;
    for (int left = times; left > 0; left /= 2) {
      if (left % 2 == 1) product_ *= power;
      if (left > 1) power *= power.eval();
    }
  }

  void flush() {
    if (factors_ > 0) sum_ += product_.log();
    product_.setOnes();
    factors_ = 0;
  }

  ArrayXd sum_, product_;
  int factors_ = 0;
};

/// Shares at each level on the grid, columns of cells one after the other.
std::vector<ArrayXd> shares_at_levels(const GroupAnswers& answers,
                                      const GroupPsychometricModel& model, const Axes& axes) {
  const auto rows = static_cast<Index>(axes.location.points);
  const auto columns = static_cast<Index>(axes.width.points);
  const ArrayXd locations =
      places_of(model, ArrayXd::LinSpaced(rows, axes.location.low, axes.location.high));
  std::vector<ArrayXd> out;
  for (const LevelCount& count : answers.counts) {
    const double x = place_of(model, count.level);
    ArrayXd z(rows * columns);
    for (Index c = 0; c < columns; ++c) {
      const double width = std::exp(axes.width.at(static_cast<std::size_t>(c)));
      z.segment(c * rows, rows) = (x - locations) / width;
    }
    out.push_back(shares(model.function.shape, z));
  }
  return out;
}

double lower_end(const GroupPsychometricModel& model, double guess, double lapse) {
  if (model.asymptotes == GroupAsymptotes::both_lapse) return lapse;
  return model.asymptotes == GroupAsymptotes::fixed_guess ? model.guess : guess;
}

/// Likelihood of each setting.
std::vector<GroupLikelihood> likelihoods_of(const GroupAnswers& answers,
                                            const GroupPsychometricModel& model, const Axes& axes,
                                            const Rates& rates) {
  const std::size_t settings = rates.lapse.means.size() * rates.guess.means.size();
  if (answers.empty()) return std::vector<GroupLikelihood>(settings);
  const std::vector<ArrayXd> at_levels = shares_at_levels(answers, model, axes);
  const auto rows = static_cast<Index>(axes.location.points);
  const auto columns = static_cast<Index>(axes.width.points);
  const std::size_t lapses = rates.lapse.nodes.size(), guesses = rates.guess.nodes.size();
  ArrayXXd nodes(rows * columns, static_cast<Index>(lapses * guesses));
  for (std::size_t g = 0; g < guesses; ++g) {
    for (std::size_t l = 0; l < lapses; ++l) {
      const double lapse = rates.lapse.nodes[l];
      const double low = lower_end(model, rates.guess.nodes[g], lapse);
      LogLikelihood sum(rows * columns);
      for (std::size_t i = 0; i < at_levels.size(); ++i) {
        const LevelCount& count = answers.counts[i];
        sum.add(low + (1 - low - lapse) * at_levels[i], count.successes,
                count.trials - count.successes);
      }
      if (answers.catch_trials > 0)
        sum.add(ArrayXd::Constant(rows * columns, low), answers.catch_successes,
                answers.catch_trials - answers.catch_successes);
      nodes.col(static_cast<Index>(g * lapses + l)) = sum.value();
    }
  }
  const double scale = nodes.maxCoeff();
  nodes = (nodes - scale).exp();
  std::vector<GroupLikelihood> out;
  for (const double guess_mean : rates.guess.means) {
    const std::vector<double> guess_weights = rates.guess.weights(guess_mean);
    for (const double lapse_mean : rates.lapse.means) {
      const std::vector<double> lapse_weights = rates.lapse.weights(lapse_mean);
      Eigen::VectorXd weights(nodes.cols());
      for (std::size_t i = 0; i < guesses * lapses; ++i)
        weights[static_cast<Index>(i)] = guess_weights[i / lapses] * lapse_weights[i % lapses];
      const Eigen::VectorXd mixed = nodes.matrix() * weights;
      out.push_back(
          group_likelihood(Eigen::Map<const MatrixXd>(mixed.data(), rows, columns), scale));
    }
  }
  return out;
}

/// Places of all levels of all participants, in order.
std::set<double> all_places(const std::vector<std::vector<GroupAnswers>>& answers,
                            const GroupPsychometricModel& model) {
  std::set<double> places;
  for (const auto& condition : answers) {
    for (const GroupAnswers& one : condition) {
      for (const LevelCount& count : one.counts) {
        // Level 0 has no place on a logarithmic scale.
        const double place = place_of(model, count.level);
        if (std::isfinite(place)) places.insert(place);
      }
    }
  }
  return places;
}

double greatest_distance(const std::vector<std::vector<GroupAnswers>>& answers, double standard) {
  double most = 0;
  for (const auto& condition : answers) {
    for (const GroupAnswers& one : condition) {
      for (const LevelCount& count : one.counts)
        most = std::max(most, std::abs(count.level - standard));
    }
  }
  return most;
}

GroupAxis log_points(double range, std::size_t points, double floor) {
  return {std::log(range / 200), std::log(2 * range), points, floor, 1.5};
}

Axes axes_of(double low, double high, double most_distance, const GroupPsychometricModel& model,
             const GroupGrid& grid) {
  const double range = high - low;
  Axes axes;
  axes.width = log_points(range, grid.widths, grid.width_floor);
  if (model.standard) {
    axes.location = log_points(most_distance, grid.locations, grid.width_floor);
    return axes;
  }
  axes.location = {low - grid.beyond * range, high + grid.beyond * range, grid.locations,
                   range / grid.floor_parts, 2 * range};
  // A level of a linear scale above 0 has a threshold above 0.
  if (model.function.scale == protocols::LevelScale::linear) {
    if (low > 0) axes.location.low = std::max(0.0, axes.location.low);
    if (high < 0) axes.location.high = std::min(0.0, axes.location.high);
  }
  return axes;
}

}  // namespace

GroupPsychometricData group_psychometric_data(const std::vector<std::vector<GroupAnswers>>& answers,
                                              const GroupPsychometricModel& model,
                                              const GroupGrid& grid) {
  GroupPsychometricData out;
  const std::set<double> places = all_places(answers, model);
  if (places.size() < 2) {
    out.undefined = "fewer than two levels";
    return out;
  }
  out.least_spacing = std::numeric_limits<double>::infinity();
  for (auto next = std::next(places.begin()); next != places.end(); ++next)
    out.least_spacing = std::min(out.least_spacing, *next - *std::prev(next));
  const double distance = model.standard ? greatest_distance(answers, *model.standard) : 0;
  const Axes axes = axes_of(*places.begin(), *places.rbegin(), distance, model, grid);
  const Rates rates = rates_of(model);
  out.data.first = axes.location;
  out.data.second = axes.width;
  for (std::size_t g = 0; g < rates.guess.means.size(); ++g)
    out.lapse_means.insert(out.lapse_means.end(), rates.lapse.means.begin(),
                           rates.lapse.means.end());
  out.data.likelihoods.assign(out.lapse_means.size(),
                              std::vector<std::vector<GroupLikelihood>>(answers.size()));
  for (std::size_t c = 0; c < answers.size(); ++c) {
    for (const GroupAnswers& one : answers[c]) {
      std::vector<GroupLikelihood> settings = likelihoods_of(one, model, axes, rates);
      for (std::size_t s = 0; s < settings.size(); ++s)
        out.data.likelihoods[s][c].push_back(std::move(settings[s]));
    }
  }
  return out;
}

double group_level(const GroupPsychometricModel& model, double location) {
  if (model.standard) return std::exp(location);
  const double place = model.function.easier == protocols::Easier::higher ? location : -location;
  return model.function.scale == protocols::LevelScale::linear ? place : std::exp(place);
}

}  // namespace palpate::analysis
