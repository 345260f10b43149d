#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <variant>

#include "analysis/report/answer_model_report.h"
#include "analysis/report/design_report.h"
#include "analysis/report/inference_json.h"
#include "analysis/report/report.h"
#include "analysis/report/task_tables.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {
namespace {

Json ends_json(const std::optional<Interval>& interval) {
  if (!interval) return nullptr;
  return {number(interval->low), number(interval->high)};
}

/// Word for it in protocols.
const char* easier_name(protocols::Easier easier) {
  return easier == protocols::Easier::higher ? "higher" : "lower";
}

Json fit_json(const ParticipantFunction& one) {
  Json fit;
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
  fit["deviance_p"] = number(one.goodness.p);
  fit["pse"] = number(one.figures.pse);
  fit["pse_ci95"] = ends_json(one.figures.pse_ci95);
  fit["jnd"] = number(one.figures.jnd);
  fit["jnd_ci95"] = ends_json(one.figures.jnd_ci95);
  fit["weber_fraction"] = number(one.figures.weber_fraction);
  fit["weber_fraction_ci95"] = ends_json(one.figures.weber_fraction_ci95);
  return fit;
}

Json posterior_json(const PsychometricPosterior& posterior) {
  Json out;
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

/// An adaptive procedure's own estimate.
Json procedure_json(const TrackProcedure& procedure) {
  const protocols::Estimate& estimate = procedure.estimate;
  Json out{{"kind", kind_of(procedure.spec)},
           {"threshold", number(estimate.threshold)},
           {"threshold_scale_sd", number(estimate.threshold_scale_sd)},
           {"slope", number(estimate.slope)},
           {"guess", number(estimate.guess)},
           {"lapse", number(estimate.lapse)},
           {"n_trials", estimate.trials},
           {"n_reversals", estimate.reversals},
           {"n_at_limit", estimate.at_limit},
           {"converges_at", number(procedure.target)},
           {"fit_level_there", number(procedure.fitted_level)}};
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&procedure.spec)) {
    out["function"] = to_string(quest->function.shape);
    out["scale"] = to_string(quest->function.scale);
  }
  return out;
}

/// \param alternatives  of a forced choice; 0: of another task
Json function_json(const ParticipantFunction& one, int alternatives) {
  Json out{{"participant_id", one.participant}};
  for (const LevelCount& count : one.counts) {
    Json level{{"level", count.level}, {"trials", count.trials}, {"successes", count.successes}};
    if (alternatives > 0 && count.trials > 0) {
      const auto found = forced_choice_detectability(count.successes, count.trials, alternatives);
      level["d_prime"] = number(found.d_prime);
      level["d_prime_ci95"] = ends_json(found.d_prime_ci95);
    }
    out["levels"].push_back(std::move(level));
  }
  out["fit"] = fit_json(one);
  out["bayes"] = posterior_json(one.posterior);
  for (const Track& track : one.tracks) {
    out["tracks"].push_back({{"track", track.name},
                             {"levels", track.levels},
                             {"successes", track.successes},
                             {"reversal_trials", Json::array()}});
    for (const std::size_t at : track.reversals)
      out["tracks"].back()["reversal_trials"].push_back(at + 1);
    if (track.procedure) out["tracks"].back()["procedure"] = procedure_json(*track.procedure);
  }
  Json detection;
  put_status(detection, one.detectability.undefined);
  if (one.detectability.undefined.empty()) {
    detection["d_prime"] = number(one.detectability.d_prime);
    detection["d_prime_ci95"] = ends_json(one.detectability.d_prime_ci95);
    detection["criterion"] = number(one.detectability.criterion);
    detection["criterion_ci95"] = ends_json(one.detectability.criterion_ci95);
  }
  out["detectability"] = detection;
  return out;
}

Json magnitude_json(const TaskCell& cell) {
  Json out{{"exponent", number(cell.magnitude->exponent)},
           {"exponent_ci95", ends_json(cell.magnitude->exponent_ci95)},
           {"n_without_logarithm", cell.magnitude->without_logarithm}};
  for (const StevensLine& line : cell.magnitude->lines) {
    out["participants"].push_back({{"participant_id", cell.participants[line.participant]},
                                   {"exponent", number(line.exponent)},
                                   {"exponent_se", number(line.exponent_se)},
                                   {"log10_scale", number(line.log10_scale)},
                                   {"r_squared", number(line.r_squared)},
                                   {"levels", Json::array()}});
    for (const StevensLine::Point& point : line.points)
      out["participants"].back()["levels"].push_back(
          {{"level", point.level}, {"geometric_mean", number(point.magnitude)}});
  }
  for (const MagnitudeMean& one : cell.magnitude->means)
    out["levels"].push_back({{"level", one.level},
                             {"geometric_mean", one.geometric_mean},
                             {"ci95", ends_json(one.ci95)},
                             {"n_participants", one.participants}});
  return out;
}

Json spread_json(const RatingSpread& spread) {
  return {{"n_ratings", spread.ratings},
          {"median", spread.median},
          {"lower_quartile", spread.lower_quartile},
          {"upper_quartile", spread.upper_quartile},
          {"mean", spread.mean}};
}

Json mean_json(const MeanRating& mean) {
  return {{"n_participants", mean.participants},
          {"mean", number(mean.mean)},
          {"sd", number(mean.sd)},
          {"ci95", ends_json(mean.ci95)}};
}

Json rated_participants_json(const std::vector<ParticipantRatings>& participants,
                             const TaskCell& cell) {
  Json out = Json::array();
  for (const ParticipantRatings& one : participants) {
    Json& entry = out.emplace_back(Json{{"participant_id", cell.participants[one.participant]}});
    entry.update(spread_json(one.spread));
  }
  return out;
}

Json ratings_json(const TaskCell& cell) {
  const Ratings& ratings = *cell.ratings;
  Json out{{"labelled", ratings.labelled}, {"steps", Json::array()}};
  for (const RatingStep& step : ratings.steps)
    out["steps"].push_back({{"number", step.number},
                            {"label", step.label.empty() ? Json() : Json(step.label)},
                            {"n_ratings", step.count},
                            {"share", number(step.share)}});
  out["all"] = ratings.spread.ratings > 0 ? spread_json(ratings.spread) : Json();
  out["mean_of_participants"] = mean_json(ratings.mean);
  out["participants"] = rated_participants_json(ratings.participants, cell);
  for (const RatingsAtLevel& at : ratings.levels)
    out["levels"].push_back({{"level", at.level},
                             {"all", spread_json(at.spread)},
                             {"mean_of_participants", mean_json(at.mean)},
                             {"participants", rated_participants_json(at.participants, cell)}});
  return out;
}

Json wilcoxon_json(const Wilcoxon& ranks) {
  Json out;
  put_status(out, ranks.undefined);
  out["V_positive_rank_sum"] = number(ranks.positive_rank_sum);
  out["n_nonzero"] = ranks.n_nonzero;
  out["p"] = number(ranks.p);
  out["method"] = ranks.exact ? "exact" : "normal approximation";
  if (ranks.p && ranks.n_nonzero < kLeastForWilcoxon)
    out["note"] = "With 5 or fewer participants who differ, the exact p cannot be below 0.05.";
  return out;
}

Json information_json(const InformationTransfer& transfer) {
  return {{"bits", number(transfer.plain)},
          {"bits_corrected", number(transfer.corrected)},
          {"se", number(transfer.se)},
          {"stimulus_entropy_bits", transfer.stimulus_entropy},
          {"categories", number(transfer.categories)}};
}

Json points_json(const std::vector<ReachPoint>& points) {
  Json out = Json::array();
  for (const ReachPoint& one : points) out.push_back({one.trial + 1, one.value});
  return out;
}

Json reaches_json(const TaskCell& cell, const Reaches& one) {
  Json out{{"participant_id", cell.participants[one.participant]},
           {"n_trials", one.trials},
           {"n_in_time", one.in_time},
           {"deviation_m", number(one.deviation)},
           {"catch_deviation_m", number(one.catch_deviation)},
           {"adaptation", number(one.adaptation)},
           {"duration_s", number(one.duration)},
           {"path_ratio", number(one.path_ratio)},
           {"endpoint_error_m", number(one.endpoint_error)}};
  Json& learning = out["learning"];
  if (one.learning.undefined.empty())
    learning = {{"status", "ok"},
                {"start_m", one.learning.start},
                {"end_m", one.learning.end},
                {"trials", one.learning.trials},
                {"residual_sd_m", one.learning.residual_sd}};
  else
    learning = {{"status", "undefined"}, {"reason", one.learning.undefined}};
  out["deviations"] = points_json(one.deviations);
  out["catch_deviations"] = points_json(one.catches);
  out["adaptations"] = points_json(one.adaptations);
  return out;
}

Json misfit_json(const FieldMisfit& misfit) {
  Json out;
  put_status(out, misfit.undefined);
  if (!misfit.undefined.empty()) return out;
  out["deviance"] = misfit.deviance;
  out["df"] = misfit.df;
  out["p"] = misfit.p;
  for (const FieldMisfit::Place& place : misfit.places)
    out["places"].push_back({{"at", place.at},
                             {"n_trials", place.trials},
                             {"free", number(place.free)},
                             {"fitted", number(place.fitted)}});
  return out;
}

Json field_participant_json(const ParticipantField& one) {
  Json out{{"participant_id", one.participant}, {"n_trials", one.fit.trials}};
  put_status(out, one.fit.undefined);
  if (!one.fit.undefined.empty()) return out;
  const auto put = [&](Json& place, const FieldParameter& parameter) {
    place = {{"estimate", number(parameter.value)},
             {"ci95", ends_json(parameter.ci95)},
             {"determined", parameter.closed}};
  };
  for (const FieldParameter& parameter : one.fit.parameters)
    put(out["parameters"][parameter.name], parameter);
  if (one.fit.jnd) {
    put(out["jnd"], *one.fit.jnd);
    out["jnd"]["standard"] = one.fit.middle;
  }
  out["log_likelihood"] = one.fit.log_likelihood;
  out["misfit"] = misfit_json(one.fit.misfit);
  return out;
}

Json field_json(const FieldAnalysis& field) {
  Json out{{"dimensions", Json::array()}};
  for (const FieldAnalysis::Dimension& one : field.dimensions)
    out["dimensions"].push_back({{"name", one.name}, {"unit", one.unit}});
  put_status(out, field.undefined);
  if (!field.undefined.empty()) return out;
  out["form"] = to_string(field.function.form);
  out["participants"] = Json::array();
  for (const ParticipantField& one : field.participants)
    out["participants"].push_back(field_participant_json(one));
  out["misfit"] = {{"n_participants", field.tested},
                   {"deviance", field.deviance},
                   {"df", field.df},
                   {"p", number(field.p)},
                   {"is", field.has_jnd() ? "natural logarithm of ratios" : "difference"},
                   {"places", Json::array()}};
  for (const MisfitPlace& place : field.places)
    out["misfit"]["places"].push_back({{"at", place.at},
                                       {"n_participants", place.participants},
                                       {"mean", place.mean},
                                       {"ci95", ends_json(place.ci95)}});
  return out;
}

Json cell_json(const TaskCell& cell) {
  Json out{
      {"task", cell.task},
      {"block_name", cell.block_name},
      {"shape", cell.shape},
      {"renderer", cell.renderer},
      {"n_trials", cell.trials},
      {"n_answered", cell.answered},
      {"n_judged", cell.judged},
      {"n_correct", cell.correct},
      {"standard_level", number(cell.standard_level)},
      {"level_unit", cell.level_unit.empty() ? Json() : Json(cell.level_unit)},
      {"expected_easier", cell.expected_easier ? Json(easier_name(*cell.expected_easier)) : Json()},
      {"forced_choice", cell.forced_choice},
      {"same_different", cell.same_different},
      {"n_intervals", cell.task == "compare" ? Json(cell.intervals) : Json()}};
  for (const ParticipantFunction& one : cell.functions)
    out["psychometric_functions"].push_back(
        function_json(one, cell.forced_choice ? cell.intervals : 0));
  if (cell.magnitude) out["magnitude_estimation"] = magnitude_json(cell);
  if (cell.ratings) out["ratings"] = ratings_json(cell);
  for (const Adjustment& one : cell.adjustments)
    out["adjustments"].push_back({{"participant_id", cell.participants[one.participant]},
                                  {"n_settings", one.settings},
                                  {"pse", one.pse},
                                  {"pse_ci95", ends_json(one.pse_ci95)},
                                  {"constant_error", one.constant_error},
                                  {"sd", number(one.sd)},
                                  {"jnd", number(one.jnd)},
                                  {"start_effect", number(one.start_effect)}});
  if (cell.field) out["field"] = field_json(*cell.field);
  for (const Reaches& one : cell.reaches) out["reaches"].push_back(reaches_json(cell, one));
  if (cell.information) {
    Json& bits = out["information_transfer"] = information_json(*cell.information);
    bits["most_bits"] = number(cell.information_most);
    bits["mean_of_participants_bits_corrected"] = number(cell.information_mean.mean);
    bits["mean_of_participants_ci95"] = ends_json(cell.information_mean.ci95);
    if (!cell.information_mean.undefined.empty())
      bits["mean_of_participants_reason"] = cell.information_mean.undefined;
    for (std::size_t i = 0; i < cell.informations.size(); ++i) {
      Json one{{"participant_id", cell.participants[i]}};
      one.update(information_json(cell.informations[i]));
      bits["participants"].push_back(std::move(one));
    }
  }
  Json confidence;
  put_status(confidence, cell.confidence.undefined);
  if (cell.confidence.area) {
    confidence["type2_roc_area"] = *cell.confidence.area;
    confidence["ci95"] = ends_json(cell.confidence.area_ci95);
    const TransformedMean& mean = cell.confidence_mean;
    confidence["mean_of_participants"] = {{"n_participants", mean.n},
                                          {"n_left_out", mean.left_out},
                                          {"type2_roc_area", number(mean.mean)},
                                          {"ci95", ends_json(mean.ci95)}};
  }
  out["confidence"] = confidence;
  return out;
}

Json group_json(const TaskGroup& group) {
  Json out{{"task", group.task},
           {"block_name", group.block_name},
           {"shape", group.shape},
           {"measure", group.measure},
           {"unit", group.unit.empty() ? Json() : Json(group.unit)},
           {"mean_is", group.geometric ? "geometric" : "arithmetic"}};
  for (const GroupMean& one : group.renderers) {
    Json renderer{{"renderer", one.renderer},
                  {"from", one.of_model ? "hierarchical model" : "participants"},
                  {"n_participants", one.of_model ? one.n_of_model : one.participants.size()},
                  {"n_undetermined", one.n_undetermined},
                  {"mean", number(one.mean)},
                  {"ci95", ends_json(one.ci95)},
                  {group.geometric ? "sd_of_natural_logs" : "sd", number(one.sd)},
                  {"participants", Json::array()}};
    for (const NamedFigure& figure : one.participants)
      renderer["participants"].push_back(
          {{"participant_id", figure.participant}, {"value", number(figure.value)}});
    out["renderers"].push_back(std::move(renderer));
  }
  return out;
}

/// The least bound of equivalence: of ratios, on the scale of logarithms.
Json least_bound(const TaskGroupComparison& one) {
  if (!one.low90 || !one.high90) return nullptr;
  const auto size = [&](double end) { return std::abs(one.ratio ? std::log(end) : end); };
  return std::max(size(*one.low90), size(*one.high90));
}

Json comparison_json(const TaskComparison& one, bool of_renderers) {
  const char* const condition = of_renderers ? "renderer" : "condition";
  Json out{{"task", one.task}, {"measure", one.measure}};
  if (one.measure == "rating" && !of_renderers) out["block_name"] = one.block_name;
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
  out["participant_sd"] = number(one.comparison.participant_sd);
  out["residual_sd"] = number(one.comparison.residual_sd);
  if (!one.comparison.differences.empty()) out["n_tests"] = one.n_tests;
  for (const ConditionDifference& difference : one.comparison.differences) {
    out["differences"].push_back({{condition, one.conditions[difference.condition]},
                                  {"n_pairs", difference.n_pairs},
                                  {"mean", number(difference.mean)},
                                  {"ci95", ends_json(difference.t_test.log_ratio_ci95)},
                                  {"t", number(difference.t_test.t)},
                                  {"df", number(difference.t_test.df)},
                                  {"p", number(difference.t_test.p)},
                                  {"p_holm", number(difference.t_test.p_holm)},
                                  {"dz", number(difference.effect_size.dz)},
                                  {"mixed_estimate", number(difference.mixed_estimate)},
                                  {"mixed_se", number(difference.mixed_se)}});
    const PairedEvidence evidence = evidence_of(difference.mean, difference.t_test);
    out["differences"].back()["ci90"] = ends_json(evidence.ci90);
    out["differences"].back()["least_bound"] = number(evidence.least_bound);
    out["differences"].back()["bf10"] = number(evidence.bayes_factor);
    if (one.measure == "rating")
      out["differences"].back()["wilcoxon"] = wilcoxon_json(difference.wilcoxon);
  }
  return out;
}

Json maybe_ends(const std::optional<double>& low, const std::optional<double>& high) {
  return {number(low), number(high)};
}

Json group_model_json(const TaskGroupModel& one) {
  Json out{{"block", one.block_name},         {"task", one.task},         {"shape", one.shape},
           {"measure", one.measure},          {"renderer", one.renderer}, {"n", one.n},
           {"estimate", number(one.estimate)}};
  if (one.level) out["level"] = *one.level;
  out["ci95"] = maybe_ends(one.low, one.high);
  out["sd_between"] = number(one.sd_between);
  out["lapse_mean"] = number(one.lapse_mean);
  out["status"] = one.status();
  if (!one.undefined.empty()) out["reason"] = one.undefined;
  out["notes"] = one.notes;
  return out;
}

Json group_comparison_json(const TaskGroupComparison& one) {
  Json out{{"block", one.block_name},
           {"task", one.task},
           {"shape", one.shape},
           {"measure", one.measure},
           {"reference", one.reference},
           {"compared", one.compared},
           {"scale", one.ratio ? "ratio" : "difference"},
           {"n", one.n},
           {"estimate", number(one.estimate)}};
  if (one.level) out["level"] = *one.level;
  out["ci95"] = maybe_ends(one.low, one.high);
  out["ci90"] = maybe_ends(one.low90, one.high90);
  out["p"] = number(one.p);
  out["p_holm"] = number(one.p_holm);
  out["lr"] = number(one.likelihood_ratio);
  out["status"] = one.status();
  if (!one.undefined.empty()) out["reason"] = one.undefined;
  const IndividualFits& fits = one.individual_fits;
  out["individual_fits"] = {{"n", fits.n},
                            {"left_out", fits.left_out},
                            {"left_out_participants", fits.left_out_names},
                            {"t", number(fits.t)},
                            {"df", number(fits.df)},
                            {"p", number(fits.p)}};
  return out;
}

/// Where a result stands by name: MEASURE.BLOCK, of several stimuli in a block
/// MEASURE.BLOCK.STIMULUS.
Json& named_place(Json& out, const StudyAnalysis& analysis, const std::string& measure,
                  const std::string& task, const std::string& block, const std::string& shape) {
  const bool several = std::ranges::any_of(analysis.cells, [&](const TaskCell& cell) {
    return cell.task == task && cell.block_name == block && cell.shape != shape;
  });
  Json& place = out[measure][block.empty() ? task : block];
  return several ? place[shape] : place;
}

/// "d_prime_at_2.5": a measure at a level.
std::string leveled(const std::string& measure, const std::optional<double>& level) {
  return level ? measure + "_at_" + short_number(*level) : measure;
}

/// A paired comparison by its names. \param place  where it stands in a root: a new key in a root
/// moves its other values, so neither place is kept
template <class Place>
void put_comparison(const TaskComparison& one, const ConditionDifference& difference, Json& out,
                    const Place& place) {
  const auto back = [&](double value) { return one.logarithms ? std::exp(value) : value; };
  const PairedEvidence evidence = evidence_of(difference.mean, difference.t_test);
  const auto& ends = difference.t_test.log_ratio_ci95;
  const auto end = [&](const std::optional<Interval>& of, bool low) {
    return of ? number(back(low ? of->low : of->high)) : Json(nullptr);
  };
  place(out).update({{one.logarithms ? "ratio" : "difference", number(back(difference.mean))},
                     {"ci95_low", end(ends, true)},
                     {"ci95_high", end(ends, false)},
                     {"ci90_low", end(evidence.ci90, true)},
                     {"ci90_high", end(evidence.ci90, false)},
                     {"t", number(difference.t_test.t)},
                     {"p", number(difference.t_test.p)},
                     {"p_holm", number(difference.t_test.p_holm)},
                     {"wilcoxon_p", number(difference.wilcoxon.p)},
                     {"bf10", number(evidence.bayes_factor)},
                     {"n", difference.n_pairs}});
  place(out["equivalence"])["least_bound"] = number(evidence.least_bound);
}

/// The name of a compared condition: BLOCK, of several stimuli in a block BLOCK.STIMULUS.
std::string short_condition(const StudyAnalysis& analysis, const TaskComparison& one,
                            const std::string& condition) {
  if (!one.block_name.empty()) return condition;
  for (const TaskCell& cell : analysis.cells) {
    if (cell.task != one.task ||
        cell.block_name + (cell.shape.empty() ? "" : ", " + cell.shape) != condition)
      continue;
    const bool several = std::ranges::any_of(analysis.cells, [&](const TaskCell& other) {
      return other.task == cell.task && other.block_name == cell.block_name &&
             other.shape != cell.shape;
    });
    return several ? cell.block_name + "." + cell.shape : cell.block_name;
  }
  return condition;
}

/// Comparisons of blocks and stimuli: between.MEASURE.REFERENCE.COMPARED, where a condition is
/// BLOCK or BLOCK.STIMULUS; of ratings between.rating.BLOCK.STIMULUS.STIMULUS. Of several renderers
/// the renderer follows.
void put_conditions(const StudyAnalysis& analysis, Json& out) {
  std::set<std::string> renderers;
  for (const TaskCell& cell : analysis.cells) renderers.insert(cell.renderer);
  for (const TaskComparison& one : analysis.conditions) {
    for (const ConditionDifference& difference : one.comparison.differences) {
      const auto place = [&](Json& root) -> Json& {
        Json* at = &root["between"][one.measure];
        if (!one.block_name.empty()) at = &(*at)[one.block_name];
        at = &(*at)[short_condition(analysis, one, one.conditions.front())];
        at = &(*at)[short_condition(analysis, one, one.conditions[difference.condition])];
        return renderers.size() > 1 ? (*at)[one.renderer] : *at;
      };
      put_comparison(one, difference, out, place);
    }
  }
}

/// The group's values without a model: means of exponents, ratings and settings.
void put_renderer_means(const StudyAnalysis& analysis, Json& out) {
  for (const TaskGroup& group : analysis.groups) {
    for (const GroupMean& one : group.renderers) {
      if (one.of_model || !one.mean) continue;
      const auto end = [&](bool low) {
        return one.ci95 ? number(low ? one.ci95->low : one.ci95->high) : Json(nullptr);
      };
      Json& place = named_place(out, analysis, group.measure, group.task, group.block_name,
                                group.shape)[one.renderer];
      if (place.is_null())
        place = {{"estimate", number(*one.mean)},
                 {"ci95_low", end(true)},
                 {"ci95_high", end(false)},
                 {"n", one.participants.size()}};
    }
  }
}

/// Results by name, for hypotheses: objects, as elements of lists have no names. Of more than two
/// renderers the compared one is a part of the name.
Json named_json(const StudyAnalysis& analysis) {
  Json out = Json::object();
  for (const TaskGroupModel& one : analysis.group_models.models) {
    Json& place = named_place(out, analysis, leveled(one.measure, one.level), one.task,
                              one.block_name, one.shape)[one.renderer];
    place = {{"estimate", number(one.estimate)},
             {"ci95_low", number(one.low)},
             {"ci95_high", number(one.high)},
             {"n", one.n}};
  }
  for (const TaskGroupComparison& one : analysis.group_models.comparisons) {
    const bool several = std::ranges::any_of(
        analysis.group_models.comparisons, [&](const TaskGroupComparison& other) {
          return other.task == one.task && other.block_name == one.block_name &&
                 other.shape == one.shape && other.compared != one.compared;
        });
    Json values{{one.ratio ? "ratio" : "difference", number(one.estimate)},
                {"ci95_low", number(one.low)},
                {"ci95_high", number(one.high)},
                {"ci90_low", number(one.low90)},
                {"ci90_high", number(one.high90)},
                {"lr", number(one.likelihood_ratio)},
                {"p", number(one.p)},
                {"p_holm", number(one.p_holm)},
                {"n", one.n}};
    const std::string measure = leveled(one.measure, one.level);
    Json& place = named_place(out, analysis, measure, one.task, one.block_name, one.shape);
    (several ? place[one.compared] : place).update(values);
    Json& bound =
        named_place(out["equivalence"], analysis, measure, one.task, one.block_name, one.shape);
    (several ? bound[one.compared] : bound)["least_bound"] = least_bound(one);
  }
  for (const TaskComparison& one : analysis.renderers) {
    if (has_model(analysis, one)) continue;
    for (const ConditionDifference& difference : one.comparison.differences) {
      const std::string& compared = one.conditions[difference.condition];
      const auto place = [&](Json& root) -> Json& {
        Json& all = named_place(root, analysis, one.measure, one.task, one.block_name, one.shape);
        return one.conditions.size() > 2 ? all[compared] : all;
      };
      put_comparison(one, difference, out, place);
    }
  }
  put_conditions(analysis, out);
  put_renderer_means(analysis, out);
  return out;
}

}  // namespace

std::string task_report_json(const StudyAnalysis& analysis, const std::string& program_version) {
  Json out{{"version", 1},
           {"simulated", analysis.table.simulated},
           {"title", analysis.table.title},
           {"source", analysis.table.source},
           {"warnings", analysis.table.warnings},
           {"program_version", program_version},
           {"n_trials", analysis.table.trials.size()},
           {"n_practice", analysis.table.n_practice},
           {"cells", Json::array()},
           {"group_results", Json::array()},
           {"renderer_comparisons", Json::array()},
           {"condition_comparisons", Json::array()}};
  for (const TaskCell& cell : analysis.cells) out["cells"].push_back(cell_json(cell));
  for (const TaskGroup& group : analysis.groups) out["group_results"].push_back(group_json(group));
  for (const TaskComparison& one : analysis.renderers)
    out["renderer_comparisons"].push_back(comparison_json(one, true));
  for (const TaskComparison& one : analysis.conditions)
    out["condition_comparisons"].push_back(comparison_json(one, false));
  out["group_model"] = Json::array();
  for (const TaskGroupModel& one : analysis.group_models.models)
    out["group_model"].push_back(group_model_json(one));
  out["group_comparisons"] = Json::array();
  for (const TaskGroupComparison& one : analysis.group_models.comparisons)
    out["group_comparisons"].push_back(group_comparison_json(one));
  out.update(named_json(analysis));
  put_design(analysis.table, analysis.by_design, out);
  if (analysis.functions.answer_model)
    out["answer_models"] = answer_models_json(analysis.answer_models);
  if (analysis.identification)
    out["identification"] = read_ordered_json(report_json(*analysis.identification));
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace palpate::analysis
