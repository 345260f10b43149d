#include "analysis/report/report_json.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "analysis/report/inference_json.h"

namespace palpate::analysis {

namespace {

void put_log_ratio_ci95(Json& out, const std::optional<Interval>& interval) {
  put_interval(out, "log_ratio_ci95", interval);
  put_reduction_ci95(out, "percent_reduction", interval);
}

Json counts(const Counts& counts) {
  return {{"n_participants", counts.n_participants}, {"n_trials", counts.n_trials},
          {"n_correct", counts.n_correct},           {"n_timeouts", counts.n_timeouts},
          {"n_too_fast", counts.n_too_fast},         {"n_used_for_times", counts.n_used_for_times},
          {"accuracy", number(counts.accuracy)}};
}

Json accuracy(const AccuracyCell& cell) {
  Json out;
  put_status(out, cell.n_trials == 0        ? "no trials"
                  : !cell.accuracy_answered ? "no trial was answered"
                                            : "");
  out["n_trials"] = cell.n_trials;
  out["n_correct"] = cell.n_correct;
  out["accuracy"] = number(cell.accuracy);
  out["accuracy_answered"] = number(cell.accuracy_answered);
  out["mean_of_participant_accuracies"] = number(cell.mean_of_participant_accuracies);
  return out;
}

Json times(const TimesCell& cell) {
  Json out;
  put_status(out, cell.n_participants == 0   ? "no trial can be used for times"
                  : cell.n_participants == 1 ? "one participant has no standard deviation"
                                             : "");
  out["n_participants"] = cell.n_participants;
  out["n_trials"] = cell.n_trials;
  out["mean_of_participant_means"] = number(cell.mean_of_participant_means);
  out["sd_of_participant_means"] = number(cell.sd_of_participant_means);
  out["mean_of_participant_medians"] = number(cell.mean_of_participant_medians);
  out["geomean_of_participant_geomeans"] = number(cell.geomean_of_participant_geomeans);
  out["mean_of_participant_mean_logs"] = number(cell.mean_of_participant_mean_logs);
  out["sd_of_participant_mean_logs"] = number(cell.sd_of_participant_mean_logs);
  return out;
}

Json paired(const PairedShape& shape, const TrialTable& table) {
  Json out;
  put_status(out, shape.undefined);
  out["n_pairs"] = shape.n_pairs;
  out["percent_reduction_arithmetic"] = number(shape.percent_reduction_arithmetic);
  out["mean_log_ratio"] = number(shape.mean_log_ratio);
  out["percent_reduction_geometric"] = number(shape.percent_reduction_geometric);

  Json& t = out["t_test"];
  put_status(t, shape.t_test.undefined);
  t["sd_log_ratio"] = number(shape.t_test.sd);
  t["se_log_ratio"] = number(shape.t_test.se);
  t["t"] = number(shape.t_test.t);
  t["df"] = number(shape.t_test.df);
  t["p"] = number(shape.t_test.p);
  put_log_ratio_ci95(t, shape.t_test.log_ratio_ci95);
  t["p_holm"] = number(shape.t_test.p_holm);

  Json& effect = out["effect_size"];
  put_status(effect, shape.effect_size.undefined);
  effect["dz"] = number(shape.effect_size.dz);
  effect["hedges_gz"] = number(shape.effect_size.hedges_gz);

  Json& ranks = out["wilcoxon"];
  put_status(ranks, shape.wilcoxon.undefined);
  ranks["V_positive_rank_sum"] = number(shape.wilcoxon.positive_rank_sum);
  ranks["n_nonzero"] = shape.wilcoxon.n_nonzero;
  ranks["p"] = number(shape.wilcoxon.p);
  ranks["method"] = shape.wilcoxon.exact ? "exact" : "normal approximation";

  Json& bootstrap = out["bootstrap"];
  put_status(bootstrap, shape.bootstrap.undefined);
  bootstrap["method"] = "BCa";
  bootstrap["resamples"] = shape.bootstrap.resamples;
  bootstrap["seed"] = shape.bootstrap.seed;
  bootstrap["bias_correction"] = number(shape.bootstrap.bias_correction);
  bootstrap["acceleration"] = number(shape.bootstrap.acceleration);
  put_log_ratio_ci95(bootstrap, shape.bootstrap.log_ratio_ci95);
  if (const auto coverage = bca_coverage(shape.n_pairs)) {
    bootstrap["coverage"] = *coverage;
    bootstrap["note"] =
        "Few pairs: `coverage` is that of the 95 % interval (simulated, normal differences; the t "
        "interval: 95 %).";
  }

  Json& dropped = out["dropped_participants"] = Json::array();
  for (const DroppedParticipant& one : shape.dropped) {
    dropped.push_back(
        {{"participant_id", table.participants[one.participant]}, {"no_time_with", one.renderers}});
  }
  return out;
}

Json paired_shapes(const Comparison& comparison, const TrialTable& table) {
  Json out;
  for (std::size_t s = 0; s < table.shapes.size(); ++s) {
    Json& one = out[table.shapes[s]] = paired(comparison.shapes[s], table);
    if (!comparison.censored.empty()) one["censored"] = censored_json(comparison.censored[s]);
  }
  return out;
}

/// paired_by_shape is the first comparison (ray with point if both are in the data); its renderers
/// are named if it is not ray with point. Further comparisons are in a list, complete.
void put_comparisons(Json& out, const Analysis& analysis) {
  const TrialTable& table = analysis.table;
  const std::vector<Comparison>& all = analysis.comparisons;
  const auto of = [](const RendererPair& pair) {
    return Json{{"renderer", pair.renderer}, {"reference", pair.reference}};
  };
  if (!all.front().pair.is_ray_minus_point()) {
    out["paired_by_shape_of"] = all.front().pair.in_data() ? of(all.front().pair) : Json(nullptr);
  }
  out["paired_by_shape"] = paired_shapes(all.front(), table);
  for (std::size_t c = 1; c < all.size(); ++c) {
    Json one = of(all[c].pair);
    one["by_shape"] = paired_shapes(all[c], table);
    one["speed_accuracy"] = speed_accuracy_json(all[c], table);
    put_pair_practice(one["practice"], analysis.practice.pairs[c], all[c].pair, table);
    out["further_comparisons"].push_back(std::move(one));
  }
}

Json provenance(const Provenance& from) {
  const auto text = [](const std::string& value) {
    return value.empty() ? Json(nullptr) : Json(value);
  };
  return {{"name", text(from.protocol_name)},
          {"sha256", from.protocol_sha256.size() == 1 ? Json(from.protocol_sha256.front())
                     : from.protocol_sha256.empty()   ? Json(nullptr)
                                                      : Json(from.protocol_sha256)}};
}

}  // namespace

std::string report_json(const Analysis& analysis) {
  const TrialTable& table = analysis.table;
  const Description& description = analysis.description;
  Json out;
  out["version"] = 1;
  out["simulated"] =
      table.simulated == Simulated::mixed ? Json("mixed") : Json(table.simulated == Simulated::yes);
  out["source"] = table.provenance.source;
  out["program_version"] = analysis.program_version;
  out["protocol"] = provenance(table.provenance);
  out["observer_sha256"] = table.provenance.observer_sha256.empty()
                               ? Json(nullptr)
                               : Json(table.provenance.observer_sha256);
  out["recorded_with"] = table.provenance.program_versions;
  out["settings"] = {{"too_fast_s", analysis.settings.too_fast}};
  out["warnings"] = analysis.warnings;
  out["counts"] = counts(description.counts);
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    const std::string& renderer = table.renderers[r];
    for (std::size_t s = 0; s < table.shapes.size(); ++s) {
      const std::string& shape = table.shapes[s];
      out["accuracy"][renderer][shape] = accuracy(description.accuracy[r][s]);
      Json& row = out["confusion"][renderer][shape];
      for (std::size_t a = 0; a < table.answers.size(); ++a) {
        row[table.answers[a]] = description.confusion[r][s][a];
      }
      row["no_response"] = description.confusion[r][s].back();
      out["times"][renderer][shape] = times(description.times[r][s]);
    }
  }
  if (analysis.time_outs.any) out["time_outs"] = time_outs_json(analysis);
  put_comparisons(out, analysis);
  out["rm_anova"] = anova_json(analysis.rm_anova, table);
  out["mixed_model"] = mixed_model_json(analysis);
  out["speed_accuracy"] = speed_accuracy_json(analysis.comparisons.front(), table);
  out["practice"] = practice_json(analysis);
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    const Exclusions& lost = analysis.exclusions[r];
    out["exclusions"][table.renderers[r]] = {{"n_trials", lost.n_trials},
                                             {"n_timeouts", lost.n_timeouts},
                                             {"n_wrong", lost.n_wrong},
                                             {"n_correct_too_fast", lost.n_too_fast},
                                             {"n_used_for_times", lost.n_used}};
  }
  // Invalid UTF-8 from a file is replaced, so that the JSON is valid.
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace palpate::analysis
