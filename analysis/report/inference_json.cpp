#include "analysis/report/inference_json.h"

#include <cmath>
#include <utility>

namespace palpate::analysis {

namespace {

constexpr const char* kModelNote =
    "Complements the primary inference (paired_by_shape.*.t_test): the model has no participant x "
    "shape variance, so its intervals are too narrow if there is such a variance.";

Json model_estimate(const ModelEstimate& value) {
  Json out;
  put_status(out, value.undefined);
  out["estimate"] = number(value.estimate);
  out["se"] = number(value.se);
  out["df_satterthwaite"] = number(value.df_satterthwaite);
  out["t"] = number(value.t);
  out["p"] = number(value.p);
  put_interval(out, "ci95", value.ci95);
  return out;
}

/// t-test on a mean over participants; its value has a separate key.
void put_test(Json& out, const TTest& test) {
  put_status(out, test.undefined);
  out["sd"] = number(test.sd);
  out["se"] = number(test.se);
  out["t"] = number(test.t);
  out["df"] = number(test.df);
  out["p"] = number(test.p);
  if (test.p_holm) out["p_holm"] = number(test.p_holm);
  put_interval(out, "ci95", test.log_ratio_ci95);
}

/// A log ratio and its interval as percent reductions.
void put_reduction(Json& out, const std::string& name, const std::optional<double>& log_ratio,
                   const std::optional<Interval>& ci95) {
  out[name] = log_ratio ? number(percent_reduction(*log_ratio)) : Json(nullptr);
  put_reduction_ci95(out, name, ci95);
}

Json order_group(const OrderGroup& group) {
  return {{"n_participants", group.n_participants},
          {"mean_log_ratio", number(group.mean_log_ratio)}};
}

Json order_effect(const OrderEffect& effect, const RendererPair& pair) {
  const bool paper = pair.is_ray_minus_point();
  Json out;
  put_test(out, effect.test);
  out["difference"] = number(effect.difference);
  out[paper ? "point_first" : "reference_first"] = order_group(effect.reference_first);
  out[paper ? "ray_first" : "renderer_first"] = order_group(effect.renderer_first);
  out["balanced_log_ratio"] = number(effect.balanced_log_ratio);
  put_reduction(out, "balanced_percent_reduction", effect.balanced_log_ratio, effect.balanced_ci95);
  return out;
}

Json learning_json(const Learning& learning) {
  Json out;
  put_test(out, learning.slope);
  out["n_participants"] = learning.n_participants;
  out["mean_slope_per_100_trials"] = number(learning.mean_slope);
  Json& bins = out["bins"] = Json::array();
  for (const LearningBin& bin : learning.bins) {
    bins.push_back({{"n_participants", bin.n_participants},
                    {"n_trials", bin.n_trials},
                    {"mean_log", number(bin.mean_log)},
                    {"se_mean_log", number(bin.se_mean_log)}});
  }
  return out;
}

/// A renderer's contrasts with the reference, by shape.
Json contrasts_json(const std::vector<ModelEstimate>& contrasts, const TrialTable& table) {
  Json out;
  for (std::size_t s = 0; s < table.shapes.size(); ++s) {
    const ModelEstimate& contrast = contrasts[s];
    Json& one = out[table.shapes[s]] = model_estimate(contrast);
    one["p_holm"] = number(contrast.p_holm);
    put_reduction(one, "percent_reduction", contrast.estimate, contrast.ci95);
  }
  return out;
}

/// One slope: separate keys for sd and correlation; several: lists.
Json variance_components(const MixedModel& model, const std::vector<std::string>& renderers) {
  const bool many = model.random_sds.size() > 2;
  Json out;
  std::optional<double> intercept, slope, correlation;
  if (!model.random_sds.empty()) intercept = model.random_sds[0];
  if (model.random_sds.size() == 2) {
    slope = model.random_sds[1];
    correlation = model.random_correlations[0];
  }
  put_status(out, !model.undefined.empty() ? model.undefined
                  : many ? "several slopes: see participant_renderer_slope_sds and correlations"
                  : !correlation ? "no correlation with a standard deviation of 0"
                                 : "");
  out["participant_intercept_sd"] = number(intercept);
  out["participant_renderer_slope_sd"] = number(slope);
  out["intercept_slope_correlation"] = number(correlation);
  out["residual_sd"] = number(model.residual_sd);
  if (!many) return out;
  Json slopes, correlations = Json::array();
  const auto name = [&](std::size_t i) { return i == 0 ? Json("intercept") : Json(renderers[i]); };
  std::size_t next = 0;
  for (std::size_t i = 1; i < renderers.size(); ++i) {
    slopes[renderers[i]] = number(model.random_sds[i]);
    for (std::size_t k = 0; k < i; ++k) {
      correlations.push_back(
          {{"of", {name(k), name(i)}}, {"value", number(model.random_correlations[next++])}});
    }
  }
  out["participant_renderer_slope_sds"] = std::move(slopes);
  out["correlations"] = std::move(correlations);
  return out;
}

}  // namespace

Json number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}

void put_interval(Json& out, const std::string& name, const std::optional<Interval>& interval) {
  out[name + "_low"] = interval ? number(interval->low) : Json(nullptr);
  out[name + "_high"] = interval ? number(interval->high) : Json(nullptr);
}

void put_reduction_ci95(Json& out, const std::string& name,
                        const std::optional<Interval>& log_ratio) {
  std::optional<Interval> reduction;
  if (log_ratio) reduction = percent_reduction(*log_ratio);
  put_interval(out, name + "_ci95", reduction);
}

void put_status(Json& out, const std::string& undefined) {
  out["status"] = undefined.empty() ? "ok" : "undefined";
  if (!undefined.empty()) out["reason"] = undefined;
}

Json censored_json(const CensoredEstimate& censored) {
  Json out;
  put_status(out, censored.undefined);
  out["method"] =
      "log-normal, time-outs right-censored at their limit, participants as fixed effects, maximum "
      "likelihood; interval by t from scores summed by participant";
  out["n_participants"] = censored.n_participants;
  out["n_observed"] = censored.n_observed;
  out["n_censored"] = censored.n_censored;
  out["log_ratio"] = number(censored.log_ratio);
  out["residual_sd"] = number(censored.residual_sd);
  out["log_likelihood"] = number(censored.log_likelihood);
  out["se_model"] = number(censored.se_model);
  out["se_log_ratio"] = number(censored.se_log_ratio);
  out["df"] = number(censored.df);
  put_interval(out, "log_ratio_ci95", censored.log_ratio_ci95);
  put_reduction(out, "percent_reduction", censored.log_ratio, censored.log_ratio_ci95);
  return out;
}

Json time_outs_json(const Analysis& analysis) {
  const TrialTable& table = analysis.table;
  Json out;
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    for (std::size_t s = 0; s < table.shapes.size(); ++s) {
      const TimeOutCell& cell = analysis.time_outs.cells[r][s];
      Json& one = out[table.renderers[r]][table.shapes[s]];
      put_status(one, cell.n_trials == 0 ? "no trials" : "");
      one["n_trials"] = cell.n_trials;
      one["n_timeouts"] = cell.n_timeouts;
      one["share"] = cell.n_trials > 0 ? Json(cell.proportion()) : Json(nullptr);
      if (cell.lowest_limit) {
        one["limit_s_low"] = *cell.lowest_limit;
        one["limit_s_high"] = *cell.highest_limit;
      }
      Json& participant_cells = one["participants"] = Json::array();
      for (std::size_t g = 0; g < cell.groups.size(); ++g) {
        const TimeOutGroup& group = cell.groups[g];
        if (g > 0 && cell.groups[g - 1].participant == group.participant) {
          participant_cells.back()["n_timeouts"] =
              participant_cells.back()["n_timeouts"].get<std::size_t>() + group.n;
          continue;
        }
        participant_cells.push_back(
            {{"participant_id", table.participants[group.participant]},
             {"n_trials", analysis.description.participant_cells[r][s][group.participant].n_trials},
             {"n_timeouts", group.n}});
      }
    }
  }
  return out;
}

Json anova_json(const RmAnova& anova, const TrialTable& table) {
  Json out;
  put_status(out, anova.undefined);
  out["n_participants_used"] = anova.n_participants_used;
  for (const AnovaEffect& effect : anova.effects) {
    Json& one = out["effects"][effect.name];
    put_status(one, effect.undefined);
    one["num_df"] = number(effect.num_df);
    one["den_df"] = number(effect.den_df);
    one["F"] = number(effect.f);
    one["p"] = number(effect.p);
    one["generalized_eta_squared"] = number(effect.generalized_eta_squared);
    Json& sphericity = one["sphericity"];
    put_status(sphericity, effect.sphericity.undefined);
    sphericity["mauchly_W"] = number(effect.sphericity.mauchly_w);
    sphericity["mauchly_p"] = number(effect.sphericity.mauchly_p);
    sphericity["mauchly_p_box"] = number(effect.sphericity.mauchly_p_box);
    sphericity["gg_epsilon"] = number(effect.sphericity.gg_epsilon);
    sphericity["gg_p"] = number(effect.sphericity.gg_p);
    sphericity["hf_epsilon_raw"] = number(effect.sphericity.hf_epsilon_raw);
    sphericity["hf_epsilon_used"] = number(effect.sphericity.hf_epsilon_used);
    sphericity["hf_p"] = number(effect.sphericity.hf_p);
  }
  Json& dropped = out["dropped_participants"] = Json::array();
  for (const std::size_t participant : anova.dropped) {
    dropped.push_back(table.participants[participant]);
  }
  return out;
}

Json shape_slope_json(const Analysis& analysis) {
  const ShapeSlopeModel& model = analysis.shape_slope_model;
  Json out;
  put_status(out, model.undefined);
  if (!model.undefined.empty()) return out;
  out["taken_out"] = model.taken_out;
  out["logLik_REML"] = number(model.log_likelihood_reml);
  out["variance_components"] = {{"participant_level_sd", number(model.participant_level_sd)},
                                {"participant_gain_sd", number(model.participant_gain_sd)},
                                {"participant_shape_level_sd", number(model.shape_level_sd)},
                                {"participant_shape_gain_sd", number(model.shape_gain_sd)},
                                {"residual_sd", number(model.residual_sd)}};
  out["contrasts"] = contrasts_json(model.contrasts, analysis.table);
  return out;
}

Json mixed_model_json(const Analysis& analysis) {
  const MixedModel& model = analysis.mixed_model;
  const TrialTable& table = analysis.table;
  Json out;
  put_status(out, model.undefined);
  if (model.undefined.empty() && !model.singular.empty()) {
    out["status"] = "singular";
    out["reason"] = model.singular;
  }
  out["n_observations"] = model.n_observations;
  out["n_participants"] = model.n_participants;
  out["logLik_REML"] = number(model.log_likelihood_reml);
  Json fixed_effects = Json::object(), tests = Json::object();
  for (const FixedEffect& effect : model.fixed_effects) {
    fixed_effects[effect.name] = number(effect.value.estimate);
    tests[effect.name] = model_estimate(effect.value);
  }
  out["fixed_effects"] = std::move(fixed_effects);
  out["fixed_effects_tests"] = std::move(tests);
  out["fixed_effects_left_out"] = model.left_out;

  out["variance_components"] = variance_components(model, table.renderers);
  for (std::size_t c = 0; c < analysis.comparisons.size(); ++c) {
    const RendererPair& pair = analysis.comparisons[c].pair;
    Json by_shape = contrasts_json(model.contrasts[c], table);
    if (pair.is_ray_minus_point()) {
      out["contrasts_ray_minus_point"] = std::move(by_shape);
    } else if (pair.in_data()) {
      out["contrasts"].push_back({{"renderer", pair.renderer},
                                  {"reference", pair.reference},
                                  {"by_shape", std::move(by_shape)}});
    }
  }
  if (!analysis.shape_slope_model.undefined.empty()) out["note"] = kModelNote;
  return out;
}

Json speed_accuracy_json(const Comparison& comparison, const TrialTable& table) {
  const bool paper = comparison.pair.is_ray_minus_point();
  Json out;
  for (std::size_t s = 0; s < comparison.speed_accuracy.size(); ++s) {
    const SpeedAccuracy& shape = comparison.speed_accuracy[s];
    Json& one = out[table.shapes[s]];
    put_test(one, shape.test);
    one["n_pairs"] = shape.n_pairs;
    one["percent_change_time"] = number(shape.percent_change_time);
    one[paper ? "accuracy_point" : "accuracy_reference"] = number(shape.accuracy_reference);
    one[paper ? "accuracy_ray" : "accuracy_renderer"] = number(shape.accuracy_renderer);
    one["accuracy_change"] = number(shape.accuracy_change);
    one["reading"] = shape.reading.empty() ? Json(nullptr) : Json(shape.reading);
  }
  return out;
}

void put_pair_practice(Json& out, const PairPractice& practice, const RendererPair& pair,
                       const TrialTable& table) {
  Json& difference =
      out[pair.is_ray_minus_point() ? "slope_difference_ray_minus_point" : "slope_difference"];
  put_test(difference, practice.slope_difference);
  difference["mean_per_100_trials"] = number(practice.mean_slope_difference);
  Json& order = out["renderer_order"];
  order["n_interleaved"] = practice.n_interleaved;
  order["all_shapes"] = order_effect(practice.all_shapes, pair);
  for (std::size_t s = 0; s < practice.shapes.size(); ++s) {
    order["shapes"][table.shapes[s]] = order_effect(practice.shapes[s], pair);
  }
}

Json practice_json(const Analysis& analysis) {
  const TrialTable& table = analysis.table;
  Json out;
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    out["learning"][table.renderers[r]] = learning_json(analysis.practice.learning[r]);
  }
  put_pair_practice(out, analysis.practice.pairs.front(), analysis.comparisons.front().pair, table);
  return out;
}

}  // namespace palpate::analysis
