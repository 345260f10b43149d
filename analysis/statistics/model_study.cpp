#include "analysis/statistics/model_study.h"

#include <algorithm>
#include <cmath>

namespace palpate::analysis {

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
