// Procedures whose levels have several dimensions.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "data/base/sobol.h"
#include "protocols/procedures/portable_math.h"
#include "protocols/procedures/procedure.h"

namespace palpate::protocols {

std::optional<LevelPoint> SobolRun::next_point() const {
  if (trials_ >= spec_.trials) return std::nullopt;
  const std::vector<double> shares =
      shifted_sobol(static_cast<std::uint64_t>(trials_), spec_.ranges.size(), seed_);
  LevelPoint point;
  for (std::size_t d = 0; d < shares.size(); ++d) {
    const DimensionRange& range = spec_.ranges[d];
    const double low = scale_position(range.scale, range.min);
    const double high = scale_position(range.scale, range.max);
    // Rounded to digits, a place near an end may lie beyond it.
    point.push_back(
        std::clamp(level_at(range.scale, low + shares[d] * (high - low)), range.min, range.max));
  }
  return point;
}

void SobolRun::record(const Response& /*response*/) { ++trials_; }

Estimate SobolRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  return result;
}

/// The tables of a run, for all its copies.
struct FieldQuestPlusTables {
  FieldQuestPlus spec;
  std::vector<LevelPoint> points;
  std::size_t combinations = 0;        ///< of parameters
  std::vector<std::size_t> marginals;  ///< of each combination: place among those of interest
  std::size_t marginal_count = 0;
  bool all_of_interest = false;
  std::vector<float> success;  ///< of each point, probability for each combination
  std::vector<float> noise;    ///< entropy of the answer, nat; only if all are of interest
};

namespace {

/// Calls visit(values) for each combination, the last parameter varying fastest.
template <class Visit>
void for_each_combination(const FieldQuestPlus& spec, Visit visit) {
  std::vector<std::size_t> at(spec.parameters.size(), 0);
  std::vector<double> values(at.size());
  while (true) {
    for (std::size_t k = 0; k < at.size(); ++k) values[k] = spec.parameters[k].values[at[k]];
    visit(at, values);
    std::size_t k = at.size();
    while (k > 0 && ++at[k - 1] == spec.parameters[k - 1].values.size()) at[--k] = 0;
    if (k == 0) return;
  }
}

std::shared_ptr<const FieldQuestPlusTables> tables_of(const FieldQuestPlus& spec) {
  auto tables = std::make_shared<FieldQuestPlusTables>();
  tables->spec = spec;
  tables->points = product_of(spec.levels);
  tables->all_of_interest = std::ranges::find(spec.interest, false) == spec.interest.end();
  tables->marginal_count = 1;
  for (std::size_t k = 0; k < spec.parameters.size(); ++k)
    if (spec.interest[k]) tables->marginal_count *= spec.parameters[k].values.size();
  for_each_combination(
      spec, [&](const std::vector<std::size_t>& at, const std::vector<double>& /*values*/) {
        std::size_t place = 0;
        for (std::size_t k = 0; k < at.size(); ++k)
          if (spec.interest[k]) place = place * spec.parameters[k].values.size() + at[k];
        tables->marginals.push_back(place);
      });
  tables->combinations = tables->marginals.size();
  tables->success.reserve(tables->points.size() * tables->combinations);
  for (const LevelPoint& point : tables->points) {
    for_each_combination(spec, [&](const auto& /*at*/, const std::vector<double>& values) {
      const double p = field_success(spec.function, values, point);
      tables->success.push_back(static_cast<float>(p));
      if (tables->all_of_interest) tables->noise.push_back(static_cast<float>(answer_entropy(p)));
    });
  }
  return tables;
}

}  // namespace

FieldQuestPlusRun::FieldQuestPlusRun(const FieldQuestPlus& spec) : tables_(tables_of(spec)) {
  posterior_.reserve(tables_->combinations);
  double sum = 0;
  for_each_combination(spec, [&](const std::vector<std::size_t>& at, const auto& /*values*/) {
    double weight = 1;
    for (std::size_t k = 0; k < at.size(); ++k) {
      const std::vector<double>& weights = spec.parameters[k].weights;
      if (!weights.empty()) weight *= weights[at[k]];
    }
    posterior_.push_back(weight);
    sum += weight;
  });
  for (double& weight : posterior_) weight /= sum;
  find_next();
}

std::vector<double> FieldQuestPlusRun::expected_information() const {
  const FieldQuestPlusTables& tables = *tables_;
  const std::size_t n = tables.combinations;
  std::vector<double> information;
  information.reserve(tables.points.size());
  std::vector<double> prior(tables.marginal_count, 0), chosen(tables.marginal_count);
  for (std::size_t i = 0; i < n; ++i) prior[tables.marginals[i]] += posterior_[i];
  for (std::size_t x = 0; x < tables.points.size(); ++x) {
    const float* const success = &tables.success[x * n];
    double p = 0, noise = 0;
    if (tables.all_of_interest) {
      const float* const entropy = &tables.noise[x * n];
      for (std::size_t i = 0; i < n; ++i) {
        p += posterior_[i] * static_cast<double>(success[i]);
        noise += posterior_[i] * static_cast<double>(entropy[i]);
      }
    } else {
      std::ranges::fill(chosen, 0);
      for (std::size_t i = 0; i < n; ++i)
        chosen[tables.marginals[i]] += posterior_[i] * static_cast<double>(success[i]);
      for (std::size_t m = 0; m < chosen.size(); ++m) {
        p += chosen[m];
        if (prior[m] > 0)
          noise += prior[m] * answer_entropy(std::clamp(chosen[m] / prior[m], 0.0, 1.0));
      }
    }
    information.push_back((answer_entropy(std::clamp(p, 0.0, 1.0)) - noise) / kLn2);
  }
  return information;
}

double FieldQuestPlusRun::entropy_bits() const {
  double sum = 0;
  for (const double p : posterior_) sum -= portable_plogp(p);
  return sum / kLn2;
}

void FieldQuestPlusRun::find_next() {
  const FieldQuestPlus& spec = tables_->spec;
  next_.reset();
  if (trials_ >= spec.stop_trials) return;
  if (spec.stop_entropy_bits.has_value() && entropy_bits() <= *spec.stop_entropy_bits) return;
  const std::vector<double> information = expected_information();
  const double best = *std::ranges::max_element(information);
  next_ = 0;
  while (information[*next_] < best - kTieBits) ++*next_;
}

std::optional<LevelPoint> FieldQuestPlusRun::next_point() const {
  if (!next_) return std::nullopt;
  return tables_->points[*next_];
}

void FieldQuestPlusRun::record(const Response& response) {
  std::vector<double> updated = posterior_;
  const auto place = std::ranges::find(tables_->points, response.point);
  const bool on_grid = place != tables_->points.end();
  const auto x = static_cast<std::size_t>(place - tables_->points.begin());
  std::size_t i = 0;
  double sum = 0;
  for_each_combination(tables_->spec, [&](const auto& /*at*/, const std::vector<double>& values) {
    const double p = on_grid ? static_cast<double>(tables_->success[x * tables_->combinations + i])
                             : field_success(tables_->spec.function, values, response.point);
    updated[i] *= response.success ? p : 1 - p;
    sum += updated[i++];
  });
  ++trials_;
  // An answer that is impossible for all parameters of the grid is ignored.
  if (sum > 0) {
    for (double& weight : updated) weight /= sum;
    posterior_ = std::move(updated);
  }
  find_next();
}

std::vector<double> FieldQuestPlusRun::marginal(std::size_t parameter) const {
  std::vector<double> sums(tables_->spec.parameters[parameter].values.size(), 0);
  std::size_t i = 0;
  for_each_combination(tables_->spec, [&](const std::vector<std::size_t>& at, const auto&) {
    sums[at[parameter]] += posterior_[i++];
  });
  return sums;
}

Estimate FieldQuestPlusRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  for (std::size_t k = 0; k < tables_->spec.parameters.size(); ++k) {
    const std::vector<double> weights = marginal(k);
    double mean = 0;
    for (std::size_t i = 0; i < weights.size(); ++i)
      mean += weights[i] * tables_->spec.parameters[k].values[i];
    result.parameters.push_back(mean);
  }
  return result;
}

}  // namespace palpate::protocols
