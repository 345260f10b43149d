#include "analysis/statistics/power.h"

#include <algorithm>
#include <atomic>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <optional>
#include <thread>

#include "analysis/statistics/mixed_model.h"
#include "analysis/statistics/paired.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kChunk = 50;  // studies per unit of work of a thread

/// Number of usable of n trials: binomial, drawn by inversion of the distribution function.
class UsedTrials {
 public:
  UsedTrials(std::size_t n, double proportion) : n_(n) {
    if (proportion >= 1) return;
    const auto trials = static_cast<double>(n);
    double sum = 0;
    up_to_.reserve(n + 1);
    for (std::size_t k = 0; k <= n; ++k) {
      const auto used = static_cast<double>(k);
      sum += std::exp(std::lgamma(trials + 1) - std::lgamma(used + 1) -
                      std::lgamma(trials - used + 1) + used * std::log(proportion) +
                      (trials - used) * std::log1p(-proportion));
      up_to_.push_back(sum);
    }
  }
  std::size_t operator()(Random& random) const {
    if (up_to_.empty()) return n_;
    const auto found = std::upper_bound(up_to_.begin(), up_to_.end(), random.unit());
    return std::min(n_, static_cast<std::size_t>(found - up_to_.begin()));
  }

 private:
  std::size_t n_;
  std::vector<double> up_to_;
};

/// Gamma of the given shape >= 0.5 and scale 1 (Marsaglia & Tsang 2000).
double gamma_draw(double shape, Random& random) {
  if (shape < 1) return gamma_draw(shape + 1, random) * std::pow(1 - random.unit(), 1 / shape);
  const double d = shape - 1.0 / 3, c = 1 / std::sqrt(9 * d);
  for (;;) {
    const double x = random.normal(), root = 1 + c * x;
    if (root <= 0) continue;
    const double v = root * root * root;
    if (std::log(1 - random.unit()) < 0.5 * x * x + d - d * v + d * std::log(v)) return d * v;
  }
}

/// Draws the sufficient statistics of a study: cells' numbers of trials, means and sums of squares.
void draw_study(const StudyModel& model, const UsedTrials& used_trials, bool squares,
                Random& random, ParticipantCells& participant_cells) {
  const std::size_t n_participants = participant_cells[0][0].size();
  const double other = std::sqrt(std::max(0.0, 1 - model.correlation * model.correlation));
  for (std::size_t p = 0; p < n_participants; ++p) {
    const double first = random.normal(), second = random.normal();
    const double intercept = model.intercept_sd * first;
    const double gain = model.gain_sd * (model.correlation * first + other * second);
    for (std::size_t s = 0; s < model.shapes.size(); ++s) {
      const double shape_gain = model.shape_gain_sd * random.normal();
      for (std::size_t r = 0; r < 2; ++r) {
        ParticipantCell& cell = participant_cells[r][s][p];
        cell.n_used = used_trials(random);
        if (cell.n_used == 0) continue;
        const auto n = static_cast<double>(cell.n_used);
        cell.mean_log = intercept + (r == 1 ? model.log_ratios[s] + gain + shape_gain : 0) +
                        model.residual_sd / std::sqrt(n) * random.normal();
        if (squares) {
          cell.sum_of_squares_log = cell.n_used < 2 ? 0
                                                    : 2 * model.residual_sd * model.residual_sd *
                                                          gamma_draw((n - 1) / 2, random);
        }
      }
    }
  }
}

/// Result of a test for a shape: unadjusted p and the sign of the effect.
struct Verdicts {
  std::vector<std::optional<double>> p;
  std::vector<double> estimates;
};

void test_pairs(const ParticipantCells& participant_cells, Verdicts& out) {
  for (std::size_t s = 0; s < out.p.size(); ++s) {
    double n = 0, mean_difference = 0, squares = 0;  // Welford (1962)
    for (std::size_t p = 0; p < participant_cells[0][s].size(); ++p) {
      if (participant_cells[0][s][p].n_used == 0 || participant_cells[1][s][p].n_used == 0)
        continue;
      const double difference =
          participant_cells[1][s][p].mean_log - participant_cells[0][s][p].mean_log;
      const double before = difference - mean_difference;
      mean_difference += before / ++n;
      squares += before * (difference - mean_difference);
    }
    out.estimates[s] = mean_difference;
    out.p[s].reset();
    if (n < 2) continue;
    const double sd = std::sqrt(squares / (n - 1));
    if (sd <= 1e-10 * std::max(1.0, std::fabs(mean_difference))) continue;
    const double t = std::fabs(mean_difference) * std::sqrt(n) / sd;
    out.p[s] = 2 * cdf(complement(boost::math::students_t(n - 1), t));
  }
}

void test_model(const ParticipantCells& participant_cells, const std::vector<std::string>& shapes,
                Verdicts& out) {
  static const std::vector<std::string> kRenderers{"point", "ray"};
  const MixedModel model = mixed_model(participant_cells, kRenderers, shapes);
  for (std::size_t s = 0; s < out.p.size(); ++s) {
    const ModelEstimate& contrast = model.contrasts.front()[s];
    out.p[s] = contrast.p;
    out.estimates[s] = contrast.estimate.value_or(0);
  }
}

void count(const StudyModel& model, const Verdicts& verdicts, double alpha, Power& out) {
  const auto adjusted = holm(verdicts.p);
  bool all = true, any = false;
  for (std::size_t s = 0; s < adjusted.size(); ++s) {
    const double effect = model.log_ratios[s];
    const bool found = adjusted[s].value_or(1) < alpha && effect * verdicts.estimates[s] >= 0;
    out.found[s] += found;
    if (effect == 0) continue;
    all = all && found;
    any = any || found;
  }
  out.all += all && any;
  out.any += any;
}

}  // namespace

Power simulate_power(const StudyModel& model, const StudyDesign& design,
                     const PowerSettings& settings) {
  const UsedTrials used_trials(design.trials, model.proportion_used);
  const std::size_t n_shapes = model.shapes.size();
  std::atomic<std::size_t> next{0}, done{0};
  const auto work = [&](Power& out, bool reports) {
    ParticipantCells participant_cells(
        2, {n_shapes, std::vector<ParticipantCell>(design.participants)});
    Verdicts verdicts{std::vector<std::optional<double>>(n_shapes), std::vector<double>(n_shapes)};
    for (;;) {
      const std::size_t begin = next.fetch_add(kChunk);
      if (begin >= settings.studies) return;
      const std::size_t end = std::min(begin + kChunk, settings.studies);
      for (std::size_t study = begin; study < end; ++study) {
        Random random(settings.seed, {design.participants, design.trials, study});
        draw_study(model, used_trials, settings.test == StudyTest::model, random,
                   participant_cells);
        if (settings.test == StudyTest::model) {
          test_model(participant_cells, model.shapes, verdicts);
        } else {
          test_pairs(participant_cells, verdicts);
        }
        count(model, verdicts, settings.alpha, out);
      }
      const std::size_t all_done = done += end - begin;
      if (reports && settings.progress) settings.progress(all_done);
    }
  };

  const Power empty{settings.studies, std::vector<std::size_t>(n_shapes), 0, 0};
  std::vector<Power> parts(std::max<std::size_t>(1, settings.jobs), empty);
  {
    std::vector<std::jthread> threads;
    threads.reserve(parts.size());
    for (std::size_t i = 1; i < parts.size(); ++i) {
      threads.emplace_back([&work, &part = parts[i]] { work(part, false); });
    }
    work(parts[0], true);
  }
  Power out = empty;
  for (const Power& part : parts) {
    for (std::size_t s = 0; s < n_shapes; ++s) out.found[s] += part.found[s];
    out.all += part.all;
    out.any += part.any;
  }
  return out;
}

std::vector<ModelAnswer> draw_answers(const StudyModel& model, double typical_time,
                                      const std::vector<ModelTrial>& trials, Random& random) {
  const double first = random.normal(), second = random.normal();
  const double other = std::sqrt(std::max(0.0, 1 - model.correlation * model.correlation));
  const double intercept = std::log(typical_time) + model.intercept_sd * first;
  const double gain = model.gain_sd * (model.correlation * first + other * second);
  std::vector<double> ratios(model.shapes.size());
  for (std::size_t s = 0; s < ratios.size(); ++s)
    ratios[s] = model.log_ratios[s] + gain + model.shape_gain_sd * random.normal();
  std::vector<ModelAnswer> answers;
  answers.reserve(trials.size());
  for (const ModelTrial& trial : trials) {
    ModelAnswer answer;
    answer.usable = random.unit() < model.proportion_used;
    if (!answer.usable && ratios.size() > 1) answer.other = 1 + random.below(ratios.size() - 1);
    answer.time = std::exp(intercept + (trial.with_renderer ? ratios[trial.shape] : 0) +
                           model.residual_sd * random.normal());
    answers.push_back(answer);
  }
  return answers;
}

StudyModel without_effect(StudyModel model) {
  std::ranges::fill(model.log_ratios, 0.0);
  return model;
}

}  // namespace palpate::analysis
