#include "analysis/statistics/field_analysis.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <map>
#include <variant>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {
namespace {

using protocols::FieldForm;
using protocols::LevelDimension;

/// The function of the block's QUEST+.
const protocols::FieldQuestPlus* quest_of(const protocols::BlockProcedures& block) {
  for (const protocols::ProcedureSpec& spec : block.specs)
    if (const auto* quest = std::get_if<protocols::FieldQuestPlus>(&spec)) return quest;
  return nullptr;
}

/// Of a standard and a comparison of one path; none: the dimensions are others.
std::optional<protocols::FieldFunction> usual_function(const protocols::BlockProcedures& block) {
  using Of = LevelDimension::Of;
  if (block.dimensions.size() != 2) return std::nullopt;
  const bool first = block.dimensions[0].of == Of::standard;
  const LevelDimension& standard = block.dimensions[first ? 0 : 1];
  const LevelDimension& other = block.dimensions[first ? 1 : 0];
  if (standard.of != Of::standard || other.of != Of::comparison ||
      standard.target.pointer != other.target.pointer)
    return std::nullopt;
  protocols::FieldFunction function;
  function.form = FieldForm::weber;
  function.other = first ? 0 : 1;
  function.x = first ? 1 : 0;
  if (block.asks_smaller) function.easier = protocols::Easier::lower;
  return function;
}

bool has_catch_trials(const std::vector<const StudyTrial*>& trials) {
  return std::ranges::any_of(trials, [](const StudyTrial* trial) { return trial->catch_trial; });
}

FieldModel model_of(const std::vector<const StudyTrial*>& trials, const FieldAnalysis& field,
                    const protocols::FieldQuestPlus* quest) {
  FieldModel model;
  model.function = field.function;
  const StudyTrial& first = *trials.front();
  const bool yes_no = first.task == "detect" || first.response == "same" ||
                      first.response == "different" || has_catch_trials(trials);
  if (yes_no) {
    model.guess = {0, true, 0.5};
  } else if (first.task == "compare" && first.intervals > 0) {
    model.guess.value = 1.0 / first.intervals;
  } else if (quest != nullptr && !has_two_lapses(field.function.form)) {
    model.guess.value = quest->parameters[quest->parameters.size() - 2].values.front();
  }
  return model;
}

/// The same for everybody: the median of the standards of QUEST+, or of those shown, each once.
std::optional<double> middle_of(const std::vector<const StudyTrial*>& trials,
                                const FieldAnalysis& field,
                                const protocols::FieldQuestPlus* quest) {
  std::vector<double> standards;
  if (quest != nullptr) {
    standards = quest->levels[field.function.other];
  } else {
    for (const StudyTrial* trial : trials)
      if (trial->dimensions.size() == field.dimensions.size())
        standards.push_back(trial->dimensions[field.function.other].second);
  }
  std::ranges::sort(standards);
  standards.erase(std::unique(standards.begin(), standards.end()), standards.end());
  if (standards.empty()) return std::nullopt;
  return standards[(standards.size() - 1) / 2];
}

protocols::LevelPoint point_of(const StudyTrial& trial) {
  protocols::LevelPoint point;
  for (const auto& [name, value] : trial.dimensions) point.push_back(value);
  return point;
}

void sum_misfits(FieldAnalysis& field) {
  std::map<double, std::vector<double>> places;
  const bool ratios = field.has_jnd();
  for (const ParticipantField& one : field.participants) {
    if (!one.fit.undefined.empty() || !one.fit.misfit.undefined.empty()) continue;
    ++field.tested;
    field.deviance += one.fit.misfit.deviance;
    field.df += one.fit.misfit.df;
    for (const FieldMisfit::Place& place : one.fit.misfit.places) {
      const double apart = ratios ? std::log(place.free / place.fitted) : place.free - place.fitted;
      // A JND between two neighbouring levels, or beyond all of them, has no logarithm to average.
      if (std::isfinite(apart) && std::abs(apart) < 5) places[place.at].push_back(apart);
    }
  }
  if (field.df > 0)
    field.p = boost::math::cdf(
        boost::math::complement(boost::math::chi_squared(field.df), field.deviance));
  for (const auto& [at, values] : places)
    field.places.push_back({at, values.size(), mean(values), t_test(values).log_ratio_ci95});
}

}  // namespace

FieldAnalysis analyze_field(const std::vector<const StudyTrial*>& trials,
                            const protocols::BlockProcedures& block) {
  FieldAnalysis field;
  for (std::size_t d = 0; d < block.dimensions.size(); ++d)
    field.dimensions.push_back({block.dimensions[d].name, block.dimension_units[d]});
  const protocols::FieldQuestPlus* const quest = quest_of(block);
  const auto usual = usual_function(block);
  if (quest != nullptr) {
    field.function = quest->function;
  } else if (usual && trials.front()->task == "compare" && trials.front()->intervals <= 2) {
    field.function = *usual;
  } else {
    field.undefined =
        "no form: the block has no QUEST+, and its dimensions are not one number of the standard "
        "and the same of the comparison";
    return field;
  }
  FieldModel common = model_of(trials, field, quest);
  common.middle = middle_of(trials, field, quest);
  std::map<std::string, std::size_t> numbers;
  std::vector<FieldModel> models;
  for (const StudyTrial* trial : trials) {
    const auto [at, is_new] = numbers.emplace(trial->participant, field.participants.size());
    if (is_new) {
      field.participants.push_back({trial->participant, {}, {}});
      models.push_back(common);
    }
    if (!trial->answered) continue;
    FieldModel& model = models[at->second];
    if (trial->catch_trial) {
      ++model.catch_trials;
      model.catch_successes += trial->success ? 1 : 0;
    } else if (trial->dimensions.size() == field.dimensions.size()) {
      field.participants[at->second].counts.push_back(
          {point_of(*trial), 1, trial->success ? 1 : 0});
    }
  }
  for (std::size_t i = 0; i < field.participants.size(); ++i) {
    ParticipantField& one = field.participants[i];
    one.counts = sum_by_point(std::move(one.counts));
    one.fit = fit_field(one.counts, models[i]);
  }
  sum_misfits(field);
  return field;
}

std::string unit_of_parameter(const FieldAnalysis& field, const std::string& name) {
  const FieldForm form = field.function.form;
  const auto unit = [&](std::size_t dimension) {
    const std::string& own = field.dimensions[dimension].unit;
    return own == "1" ? std::string() : own;
  };
  const bool jnd = name == "jnd" || (name == "c" && form == FieldForm::weber) ||
                   (name == "s" && form == FieldForm::cues);
  if (jnd) return unit(field.function.x);
  // On a logarithmic scale thresholds are logarithms.
  if (name == "a" && !has_two_lapses(form) &&
      field.function.x_scale == protocols::LevelScale::linear)
    return unit(field.function.x);
  return "";
}

}  // namespace palpate::analysis
