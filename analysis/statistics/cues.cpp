#include "analysis/statistics/cues.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/normal_tail.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

constexpr double kMostCueLapse = 0.06;
constexpr double kLeastProbability = 1e-12;
constexpr std::size_t kFewestLevels = 3;
constexpr double kUsualSpread = 0.15;  // sd of a search's start, as a share of the levels' range

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

double shared_of(double lapse, double p) { return lapse + (1 - 2 * lapse) * p; }

double chosen(double level, double mu, double sd, double lapse) {
  return shared_of(lapse, normal_cdf((level - mu) / (std::numbers::sqrt2 * sd)));
}

double log_binomial(const LevelCount& count, double p) {
  const double q = std::clamp(p, kLeastProbability, 1 - kLeastProbability);
  return count.successes * std::log(q) + (count.trials - count.successes) * std::log1p(-q);
}

double log_likelihood(const std::vector<LevelCount>& counts, double mu, double sd, double lapse) {
  double sum = 0;
  for (const LevelCount& count : counts)
    sum += log_binomial(count, chosen(count.level, mu, sd, lapse));
  return sum;
}

/// Centre and width of the range of levels, to scale the parameters of a search.
struct LevelRange {
  double centre = 0, spread = 1;
};

LevelRange scale_of(const std::vector<LevelCount>& counts) {
  double low = counts.front().level, high = low;
  for (const LevelCount& count : counts) {
    low = std::min(low, count.level);
    high = std::max(high, count.level);
  }
  return {(low + high) / 2, std::max(high - low, 1e-300)};
}

double rate_of(double x) { return kMostCueLapse / (1 + std::exp(-x)); }
double share_of(double x) { return 1 / (1 + std::exp(-x)); }

/// Parameters as the search has them: unbounded numbers of like sizes.
struct Coordinates {
  LevelRange haptic, visual;

  double haptic_mu(const std::vector<double>& x) const {
    return haptic.centre + x[0] * haptic.spread;
  }
  double haptic_sd(const std::vector<double>& x) const { return haptic.spread * std::exp(x[1]); }
  double visual_mu(const std::vector<double>& x) const {
    return visual.centre + x[2] * visual.spread;
  }
  double visual_sd(const std::vector<double>& x) const { return visual.spread * std::exp(x[3]); }
  double lapse(const std::vector<double>& x) const { return rate_of(x[4]); }
};

constexpr std::size_t kOwn = 5;  // coordinates of the single cues and the lapse rate

bool has_weight(CueModel model) {
  return model == CueModel::free_weight || model == CueModel::free ||
         model == CueModel::switching || model == CueModel::causal;
}

/// Weight and standard deviation of both cues by a model.
CueOptimum combined(CueModel model, double haptic_sd, double visual_sd,
                    const std::vector<double>& x, double spread) {
  const CueOptimum best = optimum_of(haptic_sd, visual_sd);
  switch (model) {
    case CueModel::optimal:
      return best;
    case CueModel::best_cue:
      return visual_sd < haptic_sd ? CueOptimum{1, visual_sd} : CueOptimum{0, haptic_sd};
    case CueModel::equal_weights:
      return {0.5, 0.5 * std::hypot(haptic_sd, visual_sd)};
    case CueModel::free_weight:
      return {share_of(x[kOwn]), best.sd};
    case CueModel::free:
      return {share_of(x[kOwn]), spread * std::exp(x[kOwn + 1])};
    case CueModel::switching:
    case CueModel::causal:
      return {share_of(x[kOwn]), 0};
  }
  return best;
}

/// Causal inference about a standard with a conflict and a comparison without. An estimate is the
/// optimal combination z plus a shift by the distance d of both cues, and z and d are independent.
class CausalChoice {
 public:
  /// \param one_cause  prior probability. \param range  in which two causes may be
  CausalChoice(double haptic_sd, double visual_sd, double one_cause, double range)
      : best_(optimum_of(haptic_sd, visual_sd)),
        apart_(std::hypot(haptic_sd, visual_sd)),
        one_cause_(one_cause),
        range_(range) {
    double sum = 0;
    for (std::size_t i = 0; i < kNodes; ++i) {
      const double z = kWidest * (2.0 * static_cast<double>(i) / (kNodes - 1) - 1);
      places_[i] = z * apart_;
      weights_[i] = std::exp(-0.5 * z * z);
      sum += weights_[i];
    }
    for (double& weight : weights_) weight /= sum;
    congruent_ = shifts(0);
  }
  /// That the comparison is called the larger.
  double chosen(const CueBlock& block, double level) {
    if (&block != block_) {
      block_ = &block;
      standard_ = shifts(block.conflict);
    }
    const double mu = block.middle + block.conflict * (best_.weight - 0.5);
    double sum = 0;
    for (std::size_t i = 0; i < kNodes; ++i) {
      double inner = 0;
      for (std::size_t j = 0; j < kNodes; ++j)
        inner += weights_[j] * normal_cdf((level + congruent_[i] - mu - standard_[j]) /
                                          (std::numbers::sqrt2 * best_.sd));
      sum += weights_[i] * inner;
    }
    return sum;
  }

 private:
  static constexpr std::size_t kNodes = 17;  // trapezoids, exact to 1e-7 of a normal density
  static constexpr double kWidest = 4;       // sd
  using Nodes = std::array<double, kNodes>;

  Nodes shifts(double conflict) const {
    Nodes out{};
    for (std::size_t i = 0; i < kNodes; ++i) {
      const double d = conflict + places_[i], z = d / apart_;
      const double one =
          one_cause_ * std::exp(-0.5 * z * z) / (std::sqrt(2 * std::numbers::pi) * apart_);
      const double two = (1 - one_cause_) / range_;
      out[i] = -two / (one + two) * best_.weight * d;
    }
    return out;
  }

  CueOptimum best_;
  double apart_, one_cause_, range_;
  Nodes places_{}, weights_{}, congruent_{}, standard_{};
  const CueBlock* block_ = nullptr;  ///< that standard_ is of
};

double probability_of_both(CueModel model, const CueBlock& block, double level,
                           const CueOptimum& both, double haptic_sd, double visual_sd,
                           double lapse) {
  if (model != CueModel::switching)
    return chosen(level, block.middle + block.conflict * (both.weight - 0.5), both.sd, lapse);
  const double seen =
      normal_cdf((level - block.middle - block.conflict / 2) / (std::numbers::sqrt2 * visual_sd));
  const double felt =
      normal_cdf((level - block.middle + block.conflict / 2) / (std::numbers::sqrt2 * haptic_sd));
  return shared_of(lapse, both.weight * seen + (1 - both.weight) * felt);
}

/// Beyond these a step function fits as well: the likelihood has no maximum there.
double bound(const std::vector<double>& x, std::size_t logs) {
  double sum = 0;
  for (const double log_sd : {x[1], x[3], logs < x.size() ? x[logs] : 0.0}) {
    const double beyond = std::max({0.0, -6 - log_sd, log_sd - 4});
    sum += beyond * beyond;
  }
  return sum;
}

/// A point of equality and a standard deviation, by maximum likelihood with a given lapse rate.
struct SingleFit {
  double mu = 0, sd = 0;
};

SingleFit fit_single(const std::vector<LevelCount>& counts, double lapse, double tolerance) {
  const LevelRange scale = scale_of(counts);
  const auto loss = [&](const std::vector<double>& x) {
    const double beyond = std::max({0.0, -6 - x[1], x[1] - 4, std::abs(x[0]) - 3});
    return beyond * beyond - log_likelihood(counts, scale.centre + x[0] * scale.spread,
                                            scale.spread * std::exp(x[1]), lapse);
  };
  const SimplexMinimum found = minimize(loss, {0, std::log(kUsualSpread)}, {0.1, 0.5}, tolerance);
  return {scale.centre + found.place[0] * scale.spread, scale.spread * std::exp(found.place[1])};
}

/// The standard error of the point of equality, by the expected information of the answers.
double se_of_pse(const std::vector<LevelCount>& counts, double mu, double sd, double lapse) {
  const double scale = std::numbers::sqrt2 * sd;
  double mm = 0, ms = 0, ss = 0;
  for (const LevelCount& count : counts) {
    const double z = (count.level - mu) / scale;
    const double p = std::clamp(chosen(count.level, mu, sd, lapse), 1e-9, 1 - 1e-9);
    const double slope = (1 - 2 * lapse) * std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
    const double by_mu = -slope / scale, by_log_sd = -slope * z;
    const double weight = count.trials / (p * (1 - p));
    mm += weight * by_mu * by_mu;
    ms += weight * by_mu * by_log_sd;
    ss += weight * by_log_sd * by_log_sd;
  }
  const double information = ss > 0 ? mm - ms * ms / ss : mm;
  return information > 0 ? 1 / std::sqrt(information) : INFINITY;
}

/// The standard deviation that all blocks have in common, each with a point of equality of its own,
/// by maximum likelihood. \param points  gets those
double fit_blocks(const std::vector<CueBlock>& blocks, double lapse, std::vector<CuePse>& points) {
  const LevelRange scale = scale_of(blocks.front().counts);
  std::vector<double> start, steps;
  for (const CueBlock& block : blocks) {
    const SingleFit own = fit_single(block.counts, lapse, 1e-6);
    start.push_back((own.mu - scale.centre) / scale.spread);
    steps.push_back(0.05);
  }
  // Not from the blocks' own: one that separates the levels perfectly is infinitely steep.
  start.push_back(std::log(kUsualSpread));
  steps.push_back(0.5);
  const auto loss = [&](const std::vector<double>& x) {
    const double beyond = std::max({0.0, -6 - x.back(), x.back() - 4});
    double sum = beyond * beyond;
    for (std::size_t i = 0; i < blocks.size(); ++i)
      sum -= log_likelihood(blocks[i].counts, scale.centre + x[i] * scale.spread,
                            scale.spread * std::exp(x.back()), lapse);
    return sum;
  };
  const SimplexMinimum best = minimize(loss, start, steps, 1e-9);
  const double sd = scale.spread * std::exp(best.place.back());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const double mu = scale.centre + best.place[i] * scale.spread;
    points.push_back(
        {blocks[i].conflict, blocks[i].middle, mu, se_of_pse(blocks[i].counts, mu, sd, lapse)});
  }
  return sd;
}

/// Answers of a participant of that function, at the same levels.
std::vector<LevelCount> resampled(const std::vector<LevelCount>& counts, const SingleFit& fit,
                                  double lapse, Random& random) {
  std::vector<LevelCount> out = counts;
  for (LevelCount& count : out) {
    const double p = chosen(count.level, fit.mu, fit.sd, lapse);
    count.successes = 0;
    for (int i = 0; i < count.trials; ++i) count.successes += random.unit() < p ? 1 : 0;
  }
  return out;
}

/// The smaller of two standard deviations, less the bias of its logarithm in a parametric bootstrap
/// (of the median).
double better_sd(const CueAnswers& answers, const SingleFit& haptic, const SingleFit& visual,
                 double lapse, const CueSettings& settings, std::uint64_t stream) {
  const double least = std::min(haptic.sd, visual.sd);
  if (settings.resamples <= 0) return least;
  Random random(settings.seed, {stream});
  constexpr double kRough = 1e-7;
  std::vector<double> logs;
  logs.reserve(static_cast<std::size_t>(settings.resamples));
  for (int i = 0; i < settings.resamples; ++i) {
    const double h = fit_single(resampled(answers.haptic, haptic, lapse, random), lapse, kRough).sd;
    const double v = fit_single(resampled(answers.visual, visual, lapse, random), lapse, kRough).sd;
    logs.push_back(std::log(std::min(h, v)));
  }
  // The median: a resample that separates the levels perfectly is infinitely steep.
  const double bias = median(logs) - std::log(least);
  return least * std::exp(-bias);
}

/// The slope of points of equality, less their middles, over conflicts: least squares weighted by
/// their standard errors; with one conflict the line through the origin. None without a conflict.
std::optional<double> slope_over_conflict(const std::vector<CuePse>& points) {
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  bool several = false;
  for (const CuePse& point : points) {
    if (!std::isfinite(point.se) || !(point.se > 0)) continue;
    const double weight = 1 / (point.se * point.se), y = point.pse - point.middle;
    several = several || point.conflict != points.front().conflict;
    w += weight;
    wx += weight * point.conflict;
    wy += weight * y;
    wxx += weight * point.conflict * point.conflict;
    wxy += weight * point.conflict * y;
  }
  if (!several) return wxx > 0 ? std::optional(wxy / wxx) : std::nullopt;
  const double determinant = w * wxx - wx * wx;
  if (!(determinant > 0)) return std::nullopt;
  return (w * wxy - wx * wy) / determinant;
}

std::string reason_without_figures(const CueAnswers& answers) {
  const auto few = [](const std::vector<LevelCount>& counts) {
    return counts.size() < kFewestLevels;
  };
  if (few(answers.haptic)) return "fewer than three levels in the block that is felt";
  if (few(answers.visual)) return "fewer than three levels in the block that is seen";
  if (answers.both.empty()) return "no block with both";
  for (const CueBlock& block : answers.both) {
    if (few(block.counts)) return "fewer than three levels in block '" + block.name + "'";
  }
  if (std::ranges::all_of(answers.both, [](const CueBlock& block) { return block.conflict == 0; }))
    return "no block has a conflict";
  return "";
}

/// Their number: the causal one is told from others by large and small conflicts alone.
std::size_t models_for(const CueAnswers& answers) {
  std::set<double> conflicts;
  for (const CueBlock& block : answers.both) conflicts.insert(block.conflict);
  return conflicts.size() >= kCausalConflicts ? kCueModels : kCueModels - 1;
}

/// Of the models that every participant has.
std::vector<CueModelSum> sums_of(const std::vector<CueParticipant>& participants) {
  std::size_t count = participants.empty() ? 0 : kCueModels;
  for (const CueParticipant& one : participants) count = std::min(count, one.models.size());
  std::vector<CueModelSum> out;
  for (std::size_t m = 0; m < count; ++m) {
    CueModelSum& sum = out.emplace_back(CueModelSum{static_cast<CueModel>(m), 0, 0});
    for (const CueParticipant& one : participants) {
      sum.aic += one.models[m].aic();
      sum.best_for += one.best == sum.model ? 1 : 0;
    }
  }
  return out;
}

CueTest cue_test_of(const std::vector<double>& differences) {
  CueTest out;
  if (differences.empty()) {
    out.test.undefined = "no participant has figures";
    return out;
  }
  out.mean = mean(differences);
  out.test = t_test(differences);
  return out;
}

}  // namespace

const char* to_string(CueModel model) {
  constexpr std::array kNames = {"optimal", "best-cue",  "equal-weights", "free-weight",
                                 "free",    "switching", "causal"};
  return kNames[static_cast<std::size_t>(model)];
}

CueOptimum optimum_of(double haptic_sd, double visual_sd) {
  const double felt = haptic_sd * haptic_sd, seen = visual_sd * visual_sd;
  return {felt / (felt + seen), std::sqrt(felt * seen / (felt + seen))};
}

CueModelFit fit_cues(const CueAnswers& answers, CueModel model) {
  const Coordinates at{scale_of(answers.haptic), scale_of(answers.visual)};
  const auto loss = [&](const std::vector<double>& x) {
    const double felt = at.haptic_sd(x), seen = at.visual_sd(x), lapse = at.lapse(x);
    double sum = bound(x, model == CueModel::free ? kOwn + 1 : x.size());
    sum -= log_likelihood(answers.haptic, at.haptic_mu(x), felt, lapse);
    sum -= log_likelihood(answers.visual, at.visual_mu(x), seen, lapse);
    const CueOptimum both = combined(model, felt, seen, x, at.haptic.spread);
    std::optional<CausalChoice> causal;
    if (model == CueModel::causal) causal.emplace(felt, seen, both.weight, at.haptic.spread);
    for (const CueBlock& block : answers.both) {
      for (const LevelCount& count : block.counts)
        sum -= log_binomial(count, causal ? shared_of(lapse, causal->chosen(block, count.level))
                                          : probability_of_both(model, block, count.level, both,
                                                                felt, seen, lapse));
    }
    return sum;
  };
  const double lapse = rate_of(-1);
  const SingleFit haptic = fit_single(answers.haptic, lapse, 1e-6),
                  visual = fit_single(answers.visual, lapse, 1e-6);
  std::vector<double> start = {(haptic.mu - at.haptic.centre) / at.haptic.spread,
                               std::log(haptic.sd / at.haptic.spread),
                               (visual.mu - at.visual.centre) / at.visual.spread,
                               std::log(visual.sd / at.visual.spread), -1};
  std::vector<double> steps = {0.05, 0.2, 0.05, 0.2, 1};
  if (has_weight(model)) {
    start.push_back(0);
    steps.push_back(0.7);
  }
  if (model == CueModel::free) {
    start.push_back(std::log(optimum_of(haptic.sd, visual.sd).sd / at.haptic.spread));
    steps.push_back(0.2);
  }
  SimplexMinimum best = minimize(loss, start, steps, 1e-9);
  // One cause or two may explain small conflicts.
  if (model == CueModel::causal) {
    start[kOwn] = 2;
    const SimplexMinimum other = minimize(loss, start, steps, 1e-9);
    if (other.value < best.value) best = other;
  }
  // The better cue may be either: the likelihood has a maximum on both sides.
  if (model == CueModel::best_cue) {
    std::swap(start[1], start[3]);
    const SimplexMinimum other = minimize(loss, start, steps, 1e-9);
    if (other.value < best.value) best = other;
  }
  CueModelFit fit;
  fit.parameters = static_cast<int>(start.size());
  fit.log_likelihood = -best.value;
  fit.haptic_sd = at.haptic_sd(best.place);
  fit.visual_sd = at.visual_sd(best.place);
  fit.lapse = at.lapse(best.place);
  const CueOptimum both =
      combined(model, fit.haptic_sd, fit.visual_sd, best.place, at.haptic.spread);
  fit.weight = both.weight;
  fit.both_sd = both.sd;
  return fit;
}

CueParticipant analyze_cues(const CueAnswers& answers, const CueSettings& settings,
                            std::uint64_t stream) {
  CueParticipant out;
  out.participant = answers.participant;
  out.undefined = reason_without_figures(answers);
  if (!out.undefined.empty()) return out;
  // One lapse rate, and one standard deviation of the blocks with both.
  const CueModelFit free = fit_cues(answers, CueModel::free);
  const double lapse = free.lapse;
  const SingleFit haptic = fit_single(answers.haptic, lapse, 1e-9),
                  visual = fit_single(answers.visual, lapse, 1e-9);
  const double both_sd = fit_blocks(answers.both, lapse, out.points);
  const std::optional<double> slope = slope_over_conflict(out.points);
  if (!slope) {
    out.undefined = "no point of equality is determined";
    return out;
  }
  const CueOptimum predicted = optimum_of(haptic.sd, visual.sd);
  const double jnd = kNormal75 * std::numbers::sqrt2;
  out.weight_visual = 0.5 + *slope;
  out.weight_predicted = predicted.weight;
  out.jnd_haptic = jnd * haptic.sd;
  out.jnd_visual = jnd * visual.sd;
  out.jnd_both = jnd * both_sd;
  out.jnd_predicted = jnd * predicted.sd;
  out.jnd_better = jnd * better_sd(answers, haptic, visual, lapse, settings, stream);
  if (!settings.models) return out;
  for (std::size_t m = 0; m < models_for(answers); ++m) {
    const auto model = static_cast<CueModel>(m);
    out.models.push_back(model == CueModel::free ? free : fit_cues(answers, model));
    if (out.models[m].aic() < out.models[static_cast<std::size_t>(out.best)].aic())
      out.best = model;
  }
  return out;
}

CueAnalysis analyze_all_cues(const std::vector<CueAnswers>& answers, const CueSettings& settings) {
  CueAnalysis out;
  out.settings = settings;
  std::vector<double> weight, predicted, better;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    CueParticipant one = analyze_cues(answers[i], settings, i);
    if (!one.undefined.empty()) {
      out.left_out.emplace_back(one.participant, one.undefined);
      continue;
    }
    weight.push_back(one.weight_visual - one.weight_predicted);
    predicted.push_back(std::log(one.jnd_both / one.jnd_predicted));
    better.push_back(std::log(one.jnd_both / one.jnd_better));
    out.participants.push_back(std::move(one));
  }
  out.models = sums_of(out.participants);
  out.weight = cue_test_of(weight);
  out.jnd_predicted = cue_test_of(predicted);
  out.jnd_better = cue_test_of(better);
  return out;
}

}  // namespace palpate::analysis
