#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "protocols/procedures/portable_math.h"
#include "protocols/procedures/procedure.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

/// Tables that are constant over the trials.
struct QuestPlusTables {
  QuestPlus spec;
  /// F at each level: [level][threshold, slope].
  std::vector<double> core;
  /// Entropy of an answer, nat: [level][threshold, slope, guess, lapse].
  std::vector<double> noise;

  std::size_t cores() const { return spec.threshold.values.size() * spec.slope.values.size(); }
  std::size_t rates() const { return spec.guess.values.size() * spec.lapse.values.size(); }
  std::size_t size() const { return cores() * rates(); }
};

namespace {

std::vector<double> cores_at(const QuestPlus& spec, double level) {
  std::vector<double> core;
  core.reserve(spec.threshold.values.size() * spec.slope.values.size());
  for (const double threshold : spec.threshold.values) {
    for (const double slope : spec.slope.values)
      core.push_back(psychometric_core(spec.function, level, threshold, slope));
  }
  return core;
}

/// Calls visit(guess, 1 - guess - lapse) for each pair in the order of the posterior.
template <class Visit>
void for_each_rate(const QuestPlus& spec, Visit visit) {
  for (const double guess : spec.guess.values) {
    for (const double lapse : spec.lapse.values) visit(guess, 1 - guess - lapse);
  }
}

std::shared_ptr<const QuestPlusTables> tables_of(const QuestPlus& spec) {
  auto tables = std::make_shared<QuestPlusTables>();
  tables->spec = spec;
  tables->noise.reserve(spec.levels.size() * tables->size());
  for (const double level : spec.levels) {
    for (const double core : cores_at(spec, level)) {
      tables->core.push_back(core);
      for_each_rate(spec, [&](double guess, double range) {
        tables->noise.push_back(answer_entropy(guess + range * core));
      });
    }
  }
  return tables;
}

std::vector<double> weights_of(const ParameterGrid& grid) {
  return grid.weights.empty() ? std::vector<double>(grid.values.size(), 1) : grid.weights;
}

void normalize(std::vector<double>& weights) {
  double sum = 0;
  for (const double weight : weights) sum += weight;
  for (double& weight : weights) weight /= sum;
}

/// In four sums, in a fixed order: fast, and the same everywhere.
double dot(const double* a, const double* b, std::size_t n) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4) {
    s0 += a[i] * b[i];
    s1 += a[i + 1] * b[i + 1];
    s2 += a[i + 2] * b[i + 2];
    s3 += a[i + 3] * b[i + 3];
  }
  for (; i < n; ++i) s0 += a[i] * b[i];
  return (s0 + s1) + (s2 + s3);
}

double mean_of(const std::vector<double>& weights, const std::vector<double>& values) {
  return dot(weights.data(), values.data(), values.size());
}

}  // namespace

QuestPlusRun::QuestPlusRun(const QuestPlus& spec) : tables_(tables_of(spec)) {
  posterior_.reserve(tables_->size());
  for (const double t : weights_of(spec.threshold)) {
    for (const double s : weights_of(spec.slope)) {
      for (const double g : weights_of(spec.guess)) {
        for (const double l : weights_of(spec.lapse)) posterior_.push_back(t * s * g * l);
      }
    }
  }
  normalize(posterior_);
}

std::vector<double> QuestPlusRun::expected_information() const {
  const std::size_t rates = tables_->rates(), cores = tables_->cores();
  // p = guess + range * core: summed over guess and lapse once, not at every level.
  double guesses = 0;
  std::vector<double> ranges(cores, 0);
  for (std::size_t c = 0; c < cores; ++c) {
    std::size_t i = c * rates;
    for_each_rate(tables_->spec, [&](double guess, double range) {
      guesses += posterior_[i] * guess;
      ranges[c] += posterior_[i] * range;
      ++i;
    });
  }
  std::vector<double> information;
  for (std::size_t x = 0; x < tables_->spec.levels.size(); ++x) {
    const double p = guesses + dot(ranges.data(), &tables_->core[x * cores], cores);
    const double noise =
        dot(posterior_.data(), &tables_->noise[x * posterior_.size()], posterior_.size());
    information.push_back((answer_entropy(std::clamp(p, 0.0, 1.0)) - noise) / kLn2);
  }
  return information;
}

double QuestPlusRun::entropy_bits() const {
  double sum = 0;
  for (const double p : posterior_) sum -= portable_plogp(p);
  return sum / kLn2;
}

std::optional<double> QuestPlusRun::next_level() const {
  const QuestPlus& spec = tables_->spec;
  if (trials_ >= spec.stop_trials) return std::nullopt;
  if (spec.stop_entropy_bits.has_value() && entropy_bits() <= *spec.stop_entropy_bits)
    return std::nullopt;
  const std::vector<double> information = expected_information();
  const double best = *std::max_element(information.begin(), information.end());
  std::size_t chosen = 0;
  while (information[chosen] < best - kTieBits) ++chosen;
  return spec.levels[chosen];
}

void QuestPlusRun::record(const Response& response) {
  const QuestPlus& spec = tables_->spec;
  const auto place = std::find(spec.levels.begin(), spec.levels.end(), response.level);
  const auto x = static_cast<std::size_t>(place - spec.levels.begin());
  const std::vector<double> beside =
      place == spec.levels.end() ? cores_at(spec, response.level) : std::vector<double>();
  const double* const core = beside.empty() ? &tables_->core[x * tables_->cores()] : beside.data();
  std::vector<double> updated = posterior_;
  std::size_t i = 0;
  double sum = 0;
  for (std::size_t c = 0; c < tables_->cores(); ++c) {
    for_each_rate(spec, [&](double guess, double range) {
      const double p = guess + range * core[c];
      updated[i] *= response.success ? p : 1 - p;
      sum += updated[i++];
    });
  }
  ++trials_;
  // An answer that is impossible for all parameters of the grid is ignored.
  if (!(sum > 0)) return;
  for (double& weight : updated) weight /= sum;
  posterior_ = std::move(updated);
}

std::vector<double> QuestPlusRun::marginal(std::size_t parameter) const {
  const QuestPlus& spec = tables_->spec;
  const std::array<std::size_t, 4> sizes{spec.threshold.values.size(), spec.slope.values.size(),
                                         spec.guess.values.size(), spec.lapse.values.size()};
  std::size_t inner = 1;
  for (std::size_t k = parameter + 1; k < sizes.size(); ++k) inner *= sizes[k];
  std::vector<double> sums(sizes[parameter], 0);
  for (std::size_t i = 0; i < posterior_.size(); ++i)
    sums[i / inner % sizes[parameter]] += posterior_[i];
  return sums;
}

Estimate QuestPlusRun::estimate() const {
  const QuestPlus& spec = tables_->spec;
  Estimate result;
  result.trials = trials_;
  const std::vector<double> weights = marginal(0);
  std::vector<double> places;
  for (const double threshold : spec.threshold.values)
    places.push_back(scale_position(spec.function.scale, threshold));
  const double mean = mean_of(weights, places);
  double variance = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    variance += weights[i] * (places[i] - mean) * (places[i] - mean);
  result.threshold = level_at(spec.function.scale, mean);
  result.threshold_scale_sd = std::sqrt(variance);
  result.slope = mean_of(marginal(1), spec.slope.values);
  result.guess = mean_of(marginal(2), spec.guess.values);
  result.lapse = mean_of(marginal(3), spec.lapse.values);
  return result;
}

}  // namespace palpate::protocols
