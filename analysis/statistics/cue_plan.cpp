#include "analysis/statistics/cue_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "analysis/statistics/jobs.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

/// A person of a rule. The standard is 1.
struct CuePerson {
  double haptic = 0.1, visual = 0.1;
  CueOptimum both;
};

CuePerson drawn_person(const CuePlanSettings& settings, CueModel rule, Random& random) {
  CuePerson out;
  out.haptic = settings.haptic * std::exp(settings.spread * random.normal());
  out.visual = settings.visual * std::exp(settings.spread * random.normal());
  out.both = optimum_of(out.haptic, out.visual);
  if (rule == CueModel::best_cue)
    out.both = out.visual < out.haptic ? CueOptimum{1, out.visual} : CueOptimum{0, out.haptic};
  return out;
}

/// Answers at levels that reach to 1.8 standard deviations of the function of both sides.
std::vector<LevelCount> drawn_answers(const CuePlanSettings& settings, double mu, double sd,
                                      double range, Random& random) {
  std::vector<LevelCount> out;
  for (std::size_t i = 0; i < settings.levels; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(settings.levels - 1);
    LevelCount count{1 + range * (2 * share - 1), static_cast<int>(settings.trials), 0};
    const double z = (count.level - mu) / (std::numbers::sqrt2 * sd);
    const double p =
        settings.lapse + (1 - 2 * settings.lapse) * 0.5 * std::erfc(-z / std::numbers::sqrt2);
    for (int t = 0; t < count.trials; ++t) count.successes += random.unit() < p ? 1 : 0;
    out.push_back(count);
  }
  return out;
}

CueAnalysis simulated_study(const CuePlanSettings& settings, CueModel rule, std::size_t study) {
  constexpr double kReach = 1.8;
  const double conflict =
      settings.conflict > 0 ? settings.conflict : (settings.haptic + settings.visual) / 2;
  const double range = kReach * std::numbers::sqrt2 * std::max(settings.haptic, settings.visual);
  Random random(settings.seed, {static_cast<std::uint64_t>(rule), study});
  std::vector<CueAnswers> answers;
  for (std::size_t i = 0; i < settings.participants; ++i) {
    const CuePerson person = drawn_person(settings, rule, random);
    CueAnswers one;
    one.participant = std::to_string(i + 1);
    one.haptic = drawn_answers(settings, 1, person.haptic, range, random);
    one.visual = drawn_answers(settings, 1, person.visual, range, random);
    for (const double d : {-conflict, 0.0, conflict}) {
      const double mu = 1 + d * (person.both.weight - 0.5);
      one.both.push_back({"", d, 1, drawn_answers(settings, mu, person.both.sd, range, random)});
    }
    answers.push_back(std::move(one));
  }
  CueSettings analysis;
  analysis.resamples = settings.resamples;
  analysis.seed = settings.seed + study;
  return analyze_all_cues(answers, analysis);
}

struct StudyOutcome {
  double weight = 0, jnd = 0;
  bool weight_rejected = false, jnd_rejected = false, below = false, best = false;
};

StudyOutcome outcome_of(const CueAnalysis& study, CueModel rule) {
  const auto found = [](const CueTest& test) { return test.test.p && *test.test.p < kAlpha; };
  StudyOutcome out;
  out.weight = study.weight.mean;
  out.jnd = study.jnd_predicted.mean;
  out.weight_rejected = found(study.weight);
  out.jnd_rejected = found(study.jnd_predicted);
  out.below = found(study.jnd_better) && study.jnd_better.mean < 0;
  out.best = std::ranges::min_element(study.models, {}, &CueModelSum::aic)->model == rule;
  return out;
}

}  // namespace

double gain_over_better(double ratio) { return 1 - ratio / std::hypot(1, ratio); }

std::vector<CuePlanResult> plan_cues(const CuePlanSettings& settings) {
  constexpr std::array kRules{CueModel::optimal, CueModel::best_cue};
  std::vector<StudyOutcome> outcomes(kRules.size() * settings.studies);
  do_jobs(
      outcomes.size(), settings.jobs,
      [&](std::size_t i) {
        const CueModel rule = kRules[i / settings.studies];
        outcomes[i] = outcome_of(simulated_study(settings, rule, i % settings.studies), rule);
      },
      settings.progress);
  std::vector<CuePlanResult> out;
  for (std::size_t r = 0; r < kRules.size(); ++r) {
    CuePlanResult result;
    result.rule = kRules[r];
    const double share = 1 / static_cast<double>(settings.studies);
    for (std::size_t i = 0; i < settings.studies; ++i) {
      const StudyOutcome& one = outcomes[r * settings.studies + i];
      result.weight_difference += share * one.weight;
      result.jnd_by_predicted += share * one.jnd;
      result.weight_rejected += one.weight_rejected ? share : 0;
      result.jnd_rejected += one.jnd_rejected ? share : 0;
      result.below_better += one.below ? share : 0;
      result.best_model += one.best ? share : 0;
    }
    out.push_back(result);
  }
  return out;
}

}  // namespace palpate::analysis
