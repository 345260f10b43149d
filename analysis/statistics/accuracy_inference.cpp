#include "analysis/statistics/accuracy_inference.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/group_model.h"
#include "analysis/statistics/slope_logistic.h"

namespace palpate::analysis {
namespace {

struct Share {
  double trials = 0, correct = 0;
  double value() const { return correct / trials; }
};

/// [participant][shape][0: reference, 1: renderer]
using Shares = std::vector<std::vector<std::array<Share, 2>>>;

Shares shares_of(const TrialTable& table, const RendererPair& pair, bool answered_only) {
  Shares out(table.participants.size(), std::vector<std::array<Share, 2>>(table.shapes.size()));
  for (const TrialRow& row : table.rows) {
    if (answered_only && row.timed_out) continue;
    if (row.renderer != *pair.reference_at && row.renderer != *pair.renderer_at) continue;
    Share& share = out[row.participant][row.shape][row.renderer == *pair.renderer_at ? 1 : 0];
    share.trials += 1;
    share.correct += row.correct ? 1 : 0;
  }
  return out;
}

std::optional<double> difference_of(const std::array<Share, 2>& both) {
  if (both[0].trials == 0 || both[1].trials == 0) return std::nullopt;
  return both[1].value() - both[0].value();
}

TTest test_of(const std::vector<double>& differences) {
  TTest test = t_test(differences);
  if (differences.empty()) test.undefined = "no participant has trials with both renderers";
  if (differences.size() > 1 && !test.p) test.undefined = "no errors differ";
  return test;
}

/// Answers with the used shapes, for the model.
std::vector<RenderedAnswers> answers_of(const Shares& shares, const std::vector<bool>& used) {
  std::vector<std::size_t> numbers(used.size(), 0);
  std::size_t n = 0;
  for (std::size_t s = 0; s < used.size(); ++s) {
    if (used[s]) numbers[s] = n++;
  }
  std::vector<RenderedAnswers> answers;
  for (std::size_t p = 0; p < shares.size(); ++p) {
    for (std::size_t s = 0; s < used.size(); ++s) {
      for (std::size_t r = 0; used[s] && r < 2; ++r)
        answers.push_back({p, numbers[s], r == 1, shares[p][s][r].trials, shares[p][s][r].correct});
    }
  }
  return answers;
}

bool has_both(const std::vector<std::array<Share, 2>>& own) {
  const auto any = [&](std::size_t r) {
    return std::ranges::any_of(own, [r](const auto& both) { return both[r].trials > 0; });
  };
  return any(0) && any(1);
}

AccuracyModel model_of(const Shares& shares, const std::vector<std::string>& shapes) {
  AccuracyModel out;
  out.participants = static_cast<std::size_t>(std::ranges::count_if(shares, has_both));
  std::vector<bool> used(shapes.size(), false);
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    double trials = 0, correct = 0;
    for (const auto& own : shares) {
      for (const Share& share : own[s]) {
        trials += share.trials;
        correct += share.correct;
      }
    }
    if (trials == 0) continue;
    used[s] = correct > 0 && correct < trials;
    if (!used[s])
      out.left_out.push_back(shapes[s] + (correct > 0 ? ": no errors" : ": no correct answers"));
  }
  if (out.participants < 3) {
    out.undefined = "fewer than three participants with both renderers";
    return out;
  }
  if (std::ranges::none_of(used, [](bool one) { return one; })) {
    out.undefined = "no shape with both errors and correct answers";
    return out;
  }
  const SlopeLogistic model(answers_of(shares, used));
  const SlopeLogisticFit& best = model.best();
  out.participant_sd = best.sds[0];
  out.slope_sd = best.sds[1];
  const bool finite = std::abs(best.log_odds_ratio) < kMostLogOdds;
  if (finite) out.log_odds_ratio = best.log_odds_ratio;
  const auto ratio = [&](double held) { return model.likelihood_ratio(held); };
  out.likelihood_ratio = ratio(0);
  out.t = std::copysign(group_t(*out.likelihood_ratio, out.participants), best.log_odds_ratio);
  out.p = group_p(*out.likelihood_ratio, out.participants);
  const double limit = group_limit(out.participants, 0.95);
  const double from = std::clamp(best.log_odds_ratio, -kMostLogOdds, kMostLogOdds);
  if (finite || best.log_odds_ratio > 0)
    out.ci95_low = likelihood_ratio_end(ratio, from, -2 * kMostLogOdds, 1, limit);
  if (finite || best.log_odds_ratio < 0)
    out.ci95_high = likelihood_ratio_end(ratio, from, 2 * kMostLogOdds, 1, limit);
  if (!out.ci95_low || !out.ci95_high) out.log_odds_ratio.reset();
  return out;
}

AccuracyDifference difference_in(const TrialTable& table, const RendererPair& pair,
                                 bool answered_only) {
  AccuracyDifference out;
  out.by_shape.resize(table.shapes.size());
  out.difference_by_shape.resize(table.shapes.size());
  if (!pair.in_data()) {
    out.test.undefined = out.model.undefined = "only one renderer in the data";
    for (TTest& test : out.by_shape) test.undefined = out.test.undefined;
    return out;
  }
  const Shares shares = shares_of(table, pair, answered_only);
  std::vector<double> differences;
  std::vector<std::vector<double>> by_shape(table.shapes.size());
  for (const auto& own : shares) {
    std::vector<double> of_shapes;
    for (std::size_t s = 0; s < own.size(); ++s) {
      const std::optional<double> difference = difference_of(own[s]);
      if (!difference) continue;
      of_shapes.push_back(*difference);
      by_shape[s].push_back(*difference);
    }
    if (!of_shapes.empty()) differences.push_back(mean(of_shapes));
  }
  out.n = differences.size();
  if (!differences.empty()) out.difference = mean(differences);
  out.test = test_of(differences);
  std::vector<std::optional<double>> p;
  for (std::size_t s = 0; s < by_shape.size(); ++s) {
    if (!by_shape[s].empty()) out.difference_by_shape[s] = mean(by_shape[s]);
    out.by_shape[s] = test_of(by_shape[s]);
    p.push_back(out.by_shape[s].p);
  }
  const auto adjusted = holm(p);
  for (std::size_t s = 0; s < adjusted.size(); ++s) out.by_shape[s].p_holm = adjusted[s];
  out.model = model_of(shares, table.shapes);
  return out;
}

}  // namespace

AccuracyComparison compare_accuracy(const TrialTable& table, const RendererPair& pair) {
  AccuracyComparison out{difference_in(table, pair, false), {}};
  const bool any =
      std::ranges::any_of(table.rows, [](const TrialRow& row) { return row.timed_out; });
  out.answered = any ? difference_in(table, pair, true) : out.all;
  const auto& a = out.all.test.p;
  const auto& b = out.answered.test.p;
  out.depends_on_time_outs = (a.value_or(1) < kAlpha) != (b.value_or(1) < kAlpha);
  return out;
}

}  // namespace palpate::analysis
