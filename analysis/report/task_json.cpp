#include <cmath>
#include <nlohmann/json.hpp>
#include <variant>

#include "analysis/report/report_json.h"
#include "analysis/report/task_report.h"
#include "data/base/json_text.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {
namespace {

using TaskJson = nlohmann::ordered_json;

TaskJson finite(double value) { return std::isfinite(value) ? TaskJson(value) : TaskJson(nullptr); }

TaskJson maybe(const std::optional<double>& value) {
  return value ? finite(*value) : TaskJson(nullptr);
}

TaskJson ends_json(const std::optional<Interval>& interval) {
  if (!interval) return nullptr;
  return {finite(interval->low), finite(interval->high)};
}

/// As protocols say it.
const char* easier_name(protocols::Easier easier) {
  return easier == protocols::Easier::higher ? "higher" : "lower";
}

void put_status(TaskJson& out, const std::string& undefined) {
  out["status"] = undefined.empty() ? "ok" : "undefined";
  if (!undefined.empty()) out["reason"] = undefined;
}

TaskJson fit_json(const ParticipantFunction& one) {
  TaskJson fit;
  put_status(fit, one.fit.undefined);
  if (!one.fit.undefined.empty()) return fit;
  fit["function"] = to_string(one.model.function.shape);
  fit["scale"] = to_string(one.model.function.scale);
  fit["easier"] = easier_name(one.model.function.easier);
  fit["reversed"] = one.reversed;
  fit["threshold"] = one.fit.parameters.threshold;
  fit["threshold_ci95"] = ends_json(one.fit.threshold_ci95);
  fit["slope"] = one.fit.parameters.slope;
  fit["slope_ci95"] = ends_json(one.fit.slope_ci95);
  fit["determined"] = one.determined;
  fit["slope_at_bound"] = one.fit.slope_at_bound;
  fit["guess_is_lapse"] = one.model.guess_is_lapse;
  fit["guess"] = one.fit.parameters.guess;
  fit["guess_ci95"] = ends_json(one.fit.guess_ci95);
  fit["lapse"] = one.fit.parameters.lapse;
  fit["lapse_ci95"] = ends_json(one.fit.lapse_ci95);
  fit["log_likelihood"] = one.fit.log_likelihood;
  fit["deviance"] = one.goodness.deviance;
  fit["deviance_p"] = maybe(one.goodness.p);
  fit["pse"] = maybe(one.figures.pse);
  fit["pse_ci95"] = ends_json(one.figures.pse_ci95);
  fit["jnd"] = maybe(one.figures.jnd);
  fit["jnd_ci95"] = ends_json(one.figures.jnd_ci95);
  fit["weber_fraction"] = maybe(one.figures.weber_fraction);
  fit["weber_fraction_ci95"] = ends_json(one.figures.weber_fraction_ci95);
  return fit;
}

TaskJson posterior_json(const PsychometricPosterior& posterior) {
  TaskJson out;
  put_status(out, posterior.undefined);
  if (!posterior.undefined.empty()) return out;
  out["threshold"] = posterior.mean.threshold;
  out["threshold_ci95"] = ends_json(posterior.threshold_ci95);
  out["slope"] = posterior.mean.slope;
  out["slope_ci95"] = ends_json(posterior.slope_ci95);
  out["guess"] = posterior.mean.guess;
  out["guess_ci95"] = ends_json(posterior.guess_ci95);
  out["lapse"] = posterior.mean.lapse;
  out["lapse_ci95"] = ends_json(posterior.lapse_ci95);
  return out;
}

/// What an adaptive procedure makes of its answers itself.
TaskJson procedure_json(const TrackProcedure& procedure) {
  const protocols::Estimate& estimate = procedure.estimate;
  TaskJson out{{"kind", kind_of(procedure.spec)},
               {"threshold", maybe(estimate.threshold)},
               {"threshold_scale_sd", maybe(estimate.threshold_scale_sd)},
               {"slope", maybe(estimate.slope)},
               {"guess", maybe(estimate.guess)},
               {"lapse", maybe(estimate.lapse)},
               {"n_trials", estimate.trials},
               {"n_reversals", estimate.reversals},
               {"n_at_limit", estimate.at_limit},
               {"converges_at", maybe(procedure.target)},
               {"fit_level_there", maybe(procedure.fitted_level)}};
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&procedure.spec)) {
    out["function"] = to_string(quest->function.shape);
    out["scale"] = to_string(quest->function.scale);
  }
  return out;
}

TaskJson function_json(const ParticipantFunction& one) {
  TaskJson out{{"participant_id", one.participant}};
  for (const LevelCount& count : one.counts)
    out["levels"].push_back(
        {{"level", count.level}, {"trials", count.trials}, {"successes", count.successes}});
  out["fit"] = fit_json(one);
  out["bayes"] = posterior_json(one.posterior);
  for (const Track& track : one.tracks) {
    out["tracks"].push_back({{"track", track.name},
                             {"levels", track.levels},
                             {"successes", track.successes},
                             {"reversal_trials", TaskJson::array()}});
    for (const std::size_t at : track.reversals)
      out["tracks"].back()["reversal_trials"].push_back(at + 1);
    if (track.procedure) out["tracks"].back()["procedure"] = procedure_json(*track.procedure);
  }
  TaskJson detection;
  put_status(detection, one.detectability.undefined);
  if (one.detectability.undefined.empty()) {
    detection["d_prime"] = maybe(one.detectability.d_prime);
    detection["d_prime_ci95"] = ends_json(one.detectability.d_prime_ci95);
    detection["criterion"] = maybe(one.detectability.criterion);
    detection["criterion_ci95"] = ends_json(one.detectability.criterion_ci95);
  }
  out["detectability"] = detection;
  return out;
}

TaskJson magnitude_json(const TaskCell& cell) {
  TaskJson out{{"exponent", maybe(cell.magnitude->exponent)},
               {"exponent_ci95", ends_json(cell.magnitude->exponent_ci95)},
               {"n_without_logarithm", cell.magnitude->without_logarithm}};
  for (const StevensLine& line : cell.magnitude->lines)
    out["participants"].push_back({{"participant_id", cell.participants[line.participant]},
                                   {"exponent", maybe(line.exponent)},
                                   {"exponent_se", maybe(line.exponent_se)},
                                   {"log10_scale", maybe(line.log10_scale)},
                                   {"r_squared", maybe(line.r_squared)}});
  for (const MagnitudeMean& one : cell.magnitude->means)
    out["levels"].push_back({{"level", one.level},
                             {"geometric_mean", one.geometric_mean},
                             {"ci95", ends_json(one.ci95)},
                             {"n_participants", one.participants}});
  return out;
}

TaskJson information_json(const InformationTransfer& transfer) {
  return {{"bits", maybe(transfer.plain)},
          {"bits_corrected", maybe(transfer.corrected)},
          {"se", maybe(transfer.se)},
          {"stimulus_entropy_bits", transfer.stimulus_entropy},
          {"categories", maybe(transfer.categories)}};
}

TaskJson cell_json(const TaskCell& cell) {
  TaskJson out{{"task", cell.task},
               {"block_name", cell.block_name},
               {"shape", cell.shape},
               {"renderer", cell.renderer},
               {"n_trials", cell.trials},
               {"n_answered", cell.answered},
               {"n_judged", cell.judged},
               {"n_correct", cell.correct},
               {"standard_level", maybe(cell.standard_level)},
               {"level_unit", cell.level_unit.empty() ? TaskJson() : TaskJson(cell.level_unit)},
               {"expected_easier",
                cell.expected_easier ? TaskJson(easier_name(*cell.expected_easier)) : TaskJson()},
               {"forced_choice", cell.forced_choice},
               {"same_different", cell.same_different},
               {"n_intervals", cell.task == "compare" ? TaskJson(cell.intervals) : TaskJson()}};
  for (const ParticipantFunction& one : cell.functions)
    out["psychometric_functions"].push_back(function_json(one));
  if (cell.magnitude) out["magnitude_estimation"] = magnitude_json(cell);
  for (const Adjustment& one : cell.adjustments)
    out["adjustments"].push_back({{"participant_id", cell.participants[one.participant]},
                                  {"n_settings", one.settings},
                                  {"pse", one.pse},
                                  {"pse_ci95", ends_json(one.pse_ci95)},
                                  {"constant_error", one.constant_error},
                                  {"sd", maybe(one.sd)},
                                  {"jnd", maybe(one.jnd)},
                                  {"start_effect", maybe(one.start_effect)}});
  if (cell.information) {
    TaskJson& bits = out["information_transfer"] = information_json(*cell.information);
    bits["mean_of_participants_bits_corrected"] = maybe(cell.information_mean);
    bits["mean_of_participants_ci95"] = ends_json(cell.information_ci95);
    for (std::size_t i = 0; i < cell.informations.size(); ++i) {
      TaskJson one{{"participant_id", cell.participants[i]}};
      one.update(information_json(cell.informations[i]));
      bits["participants"].push_back(std::move(one));
    }
  }
  TaskJson confidence;
  put_status(confidence, cell.confidence.undefined);
  if (cell.confidence.area) {
    confidence["type2_roc_area"] = *cell.confidence.area;
    confidence["ci95"] = ends_json(cell.confidence.area_ci95);
  }
  out["confidence"] = confidence;
  return out;
}

TaskJson group_json(const TaskGroup& group) {
  TaskJson out{{"task", group.task},
               {"block_name", group.block_name},
               {"shape", group.shape},
               {"measure", group.measure},
               {"unit", group.unit.empty() ? TaskJson() : TaskJson(group.unit)},
               {"mean_is", group.geometric ? "geometric" : "arithmetic"}};
  for (const GroupMean& one : group.renderers) {
    TaskJson renderer{{"renderer", one.renderer},
                      {"n_participants", one.participants.size()},
                      {"n_undetermined", one.n_undetermined},
                      {"mean", maybe(one.mean)},
                      {"ci95", ends_json(one.ci95)},
                      {group.geometric ? "sd_of_natural_logs" : "sd", maybe(one.sd)},
                      {"participants", TaskJson::array()}};
    for (const NamedFigure& figure : one.participants)
      renderer["participants"].push_back(
          {{"participant_id", figure.participant}, {"value", finite(figure.value)}});
    out["renderers"].push_back(std::move(renderer));
  }
  return out;
}

TaskJson comparison_json(const TaskComparison& one, bool of_renderers) {
  const char* const condition = of_renderers ? "renderer" : "condition";
  TaskJson out{{"task", one.task}, {"measure", one.measure}};
  if (of_renderers) {
    out["block_name"] = one.block_name;
    out["shape"] = one.shape;
  } else {
    out["renderer"] = one.renderer;
  }
  out["reference"] = one.conditions[0];
  out["natural_logarithms"] = one.logarithms;
  out["n_undetermined"] = one.n_undetermined;
  put_status(out, one.comparison.undefined);
  out["participant_sd"] = maybe(one.comparison.participant_sd);
  out["residual_sd"] = maybe(one.comparison.residual_sd);
  for (const ConditionDifference& difference : one.comparison.differences)
    out["differences"].push_back({{condition, one.conditions[difference.condition]},
                                  {"n_pairs", difference.n_pairs},
                                  {"mean", finite(difference.mean)},
                                  {"ci95", ends_json(difference.t_test.log_ratio_ci95)},
                                  {"t", maybe(difference.t_test.t)},
                                  {"p", maybe(difference.t_test.p)},
                                  {"p_holm", maybe(difference.t_test.p_holm)},
                                  {"dz", maybe(difference.effect_size.dz)},
                                  {"mixed_estimate", maybe(difference.mixed_estimate)},
                                  {"mixed_se", maybe(difference.mixed_se)}});
  return out;
}

/// As R's lme4 prints it: correct ~ renderer + shape + (1 | participant).
TaskJson accuracy_json(const MixedLogistic& model) {
  TaskJson out{{"model", "correct ~ renderer + shape + (1 | participant)"}};
  out["status"] = !model.undefined.empty() ? "undefined" : model.singular ? "singular" : "ok";
  if (!model.undefined.empty()) {
    out["reason"] = model.undefined;
    return out;
  }
  out["n_participants"] = model.participants;
  out["n_trials"] = model.trials;
  out["logLik"] = finite(model.log_likelihood);
  out["participant_sd"] = model.random_sds.empty() ? TaskJson() : finite(model.random_sds[0]);
  for (const LogisticCoefficient& one : model.coefficients)
    out["fixed_effects"][one.name] = {{"log_odds", finite(one.estimate)},
                                      {"se", finite(one.se)},
                                      {"z", finite(one.z)},
                                      {"p", finite(one.p)},
                                      {"ci95", ends_json(one.ci95)},
                                      {"odds_ratio", finite(std::exp(one.estimate))}};
  return out;
}

}  // namespace

std::string task_report_json(const TaskAnalysis& analysis, const std::string& program_version) {
  TaskJson out{{"version", 1},
               {"simulated", analysis.table.simulated},
               {"title", analysis.table.title},
               {"source", analysis.table.source},
               {"warnings", analysis.table.warnings},
               {"program_version", program_version},
               {"n_trials", analysis.table.trials.size()},
               {"n_practice", analysis.table.n_practice},
               {"cells", TaskJson::array()},
               {"group_results", TaskJson::array()},
               {"renderer_comparisons", TaskJson::array()},
               {"condition_comparisons", TaskJson::array()}};
  for (const TaskCell& cell : analysis.cells) out["cells"].push_back(cell_json(cell));
  for (const TaskGroup& group : analysis.groups) out["group_results"].push_back(group_json(group));
  for (const TaskComparison& one : analysis.renderers)
    out["renderer_comparisons"].push_back(comparison_json(one, true));
  for (const TaskComparison& one : analysis.conditions)
    out["condition_comparisons"].push_back(comparison_json(one, false));
  if (analysis.accuracy) out["accuracy_model"] = accuracy_json(*analysis.accuracy);
  if (analysis.identification)
    out["identification"] = read_ordered_json(report_json(*analysis.identification));
  return out.dump(1, ' ', false, TaskJson::error_handler_t::replace) + "\n";
}

}  // namespace palpate::analysis
