#include "analysis/report/movement_report.h"

#include <cmath>
#include <utility>

#include "analysis/report/inference_json.h"
#include "analysis/report/report_text.h"
#include "analysis/report/table_cells.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

const MeasureDefinition& definition(std::size_t measure) { return measure_definitions()[measure]; }

std::string movement_caption(const MovementAnalysis& analysis, const std::string& what) {
  const std::string label = simulated_label(analysis.table.trials.simulated);
  return what + (label.empty() ? "" : " (" + label + ")");
}

std::string settings_note(const MovementAnalysis& analysis) {
  return "Settings: low pass of the path at " + fixed(analysis.table.settings.cutoff, 1) +
         " Hz; contacts by rendering each trial again, to the bit.";
}

/// Four significant digits.
std::string short_number(const std::optional<double>& value) {
  if (!value || !std::isfinite(*value)) return kMissing;
  const double size = std::abs(*value);
  const int before = size >= 1 ? static_cast<int>(std::floor(std::log10(size))) + 1 : 1;
  return fixed(*value, size < 0.1 ? 4 : std::max(0, 4 - before));
}

/// The mean over participants, back from the scale.
std::optional<double> mean_in_units(const MeasureComparison& measure,
                                    const std::optional<std::size_t>& renderer, std::size_t shape) {
  if (!renderer) return std::nullopt;
  const auto& mean = measure.description.times[*renderer][shape].mean_of_participant_mean_logs;
  if (!mean) return std::nullopt;
  return from_scale(definition(measure.measure).scale, *mean);
}

const ModelEstimate* model_contrast(const MeasureComparison& measure, std::size_t comparison,
                                    std::size_t shape) {
  const auto& contrasts = measure.mixed_model.contrasts;
  if (comparison >= contrasts.size() || shape >= contrasts[comparison].size()) return nullptr;
  return &contrasts[comparison][shape];
}

Table measures_table(const MovementAnalysis& analysis, std::size_t comparison) {
  const RendererPair& pair = analysis.measures.front().comparisons[comparison].pair;
  Table table;
  table.caption = movement_caption(analysis, "Movement: " + difference_name(pair));
  table.n_names = 2;
  table.header = {"measure",  "shape", pair.reference, pair.renderer, "difference",
                  "95 % low", "high",  "p (Holm)",     "model p"};
  for (const MeasureComparison& measure : analysis.measures) {
    for (std::size_t s = 0; s < analysis.table.trials.shapes.size(); ++s) {
      const PairedShape& shape = measure.comparisons[comparison].shapes[s];
      const auto& interval = shape.t_test.log_ratio_ci95;
      const ModelEstimate* model = model_contrast(measure, comparison, s);
      table.rows.push_back({definition(measure.measure).name, analysis.table.trials.shapes[s],
                            short_number(mean_in_units(measure, pair.reference_at, s)),
                            short_number(mean_in_units(measure, pair.renderer_at, s)),
                            short_number(shape.mean_log_ratio),
                            short_number(interval ? std::optional(interval->low) : std::nullopt),
                            short_number(interval ? std::optional(interval->high) : std::nullopt),
                            p_or_missing(shape.t_test.p_holm),
                            p_or_missing(model ? model->p_holm : std::nullopt)});
    }
  }
  table.notes.push_back(
      "Means over participants in SI units, back from the scale of comparison; the difference is "
      "on that scale: log (lengths, speeds, times, forces), log of value + 1 (counts, rates), "
      "logit (shares, held within 0.005 and 0.995), as it is (sparc, ldlj). Paired t-tests over "
      "participants, p adjusted by Holm over the shapes of a measure, not over measures.");
  table.notes.push_back(settings_note(analysis));
  return table;
}

Table definitions_table() {
  Table table;
  table.caption = "Definitions";
  table.header = {"measure", "meaning"};
  table.n_names = 2;
  for (const MeasureDefinition& one : measure_definitions())
    table.rows.push_back(
        {one.name, std::string(one.meaning) +
                       (std::string(one.unit) == "1" ? "" : " [" + std::string(one.unit) + "]")});
  return table;
}

Table gains_table(const MovementAnalysis& analysis) {
  Table table;
  table.caption = movement_caption(analysis, "Gain in time beside differences of movement");
  table.n_names = 2;
  table.header = {"shape",          "measure",    "trials",
                  "log time",       "of measure", "time at equal measure",
                  "time by measure"};
  for (const AdjustedGain& gain : analysis.gains) {
    table.rows.push_back({analysis.table.trials.shapes[gain.shape], definition(gain.measure).name,
                          std::to_string(gain.n_trials), short_number(gain.time_difference),
                          short_number(gain.measure_difference),
                          short_number(gain.time_difference_at_equal_measure),
                          short_number(gain.slope)});
  }
  table.notes.push_back(
      "Correct trials, within participants. log time, of measure: difference between the "
      "renderers. time at equal measure: the difference of log time in a regression that has the "
      "measure beside the renderer; time by measure: its coefficient. The table describes which "
      "differences occur together; the movements were not set by anybody.");
  table.notes.push_back(settings_note(analysis));
  return table;
}

Json measure_json(const MovementAnalysis& analysis, const MeasureComparison& measure) {
  const MeasureDefinition& known = definition(measure.measure);
  const TrialTable& trials = analysis.table.trials;
  Json out = {{"unit", known.unit}, {"scale", scale_name(known.scale)}, {"meaning", known.meaning}};
  for (std::size_t r = 0; r < trials.renderers.size(); ++r) {
    for (std::size_t s = 0; s < trials.shapes.size(); ++s) {
      const TimesCell& cell = measure.description.times[r][s];
      Json& place = out["means"][trials.renderers[r]][trials.shapes[s]];
      place["n_participants"] = cell.n_participants;
      place["n_trials"] = cell.n_trials;
      place["mean_of_participant_means_on_scale"] = number(cell.mean_of_participant_mean_logs);
      place["sd_of_participant_means_on_scale"] = number(cell.sd_of_participant_mean_logs);
      place["mean"] = number(mean_in_units(measure, r, s));
    }
  }
  out["comparisons"] = Json::array();
  for (std::size_t c = 0; c < measure.comparisons.size(); ++c) {
    const Comparison& comparison = measure.comparisons[c];
    Json one = {{"reference", comparison.pair.reference}, {"renderer", comparison.pair.renderer}};
    for (std::size_t s = 0; s < trials.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      Json& place = one["by_shape"][trials.shapes[s]];
      put_status(place, shape.undefined.empty() ? shape.t_test.undefined : shape.undefined);
      place["n_pairs"] = shape.n_pairs;
      place["mean_difference"] = number(shape.mean_log_ratio);
      place["t"] = number(shape.t_test.t);
      place["df"] = number(shape.t_test.df);
      place["p"] = number(shape.t_test.p);
      place["p_holm"] = number(shape.t_test.p_holm);
      put_interval(place, "difference_ci95", shape.t_test.log_ratio_ci95);
      place["dz"] = number(shape.effect_size.dz);
      Json& model = place["mixed_model"];
      const ModelEstimate* contrast = model_contrast(measure, c, s);
      put_status(model, contrast == nullptr ? measure.mixed_model.undefined.empty()
                                                  ? "no contrast"
                                                  : measure.mixed_model.undefined
                                            : contrast->undefined);
      if (contrast == nullptr) continue;
      if (!measure.mixed_model.singular.empty()) model["singular"] = measure.mixed_model.singular;
      model["estimate"] = number(contrast->estimate);
      model["se"] = number(contrast->se);
      model["df_satterthwaite"] = number(contrast->df_satterthwaite);
      model["t"] = number(contrast->t);
      model["p"] = number(contrast->p);
      model["p_holm"] = number(contrast->p_holm);
    }
    out["comparisons"].push_back(std::move(one));
  }
  return out;
}

}  // namespace

MovementAnalysis analyze_movement(MovementTable table, const std::string& program_version) {
  MovementAnalysis analysis;
  analysis.measures = compare_movement(table);
  analysis.gains = adjusted_gains(table);
  analysis.table = std::move(table);
  analysis.program_version = program_version;
  return analysis;
}

std::string movement_text(const MovementAnalysis& analysis) {
  const TrialTable& trials = analysis.table.trials;
  std::string out;
  const std::string label = simulated_label(trials.simulated);
  if (!label.empty()) out += paragraph_text(label + ": the movements below are a model's.") + "\n";
  std::size_t measured = trials.rows.size();
  for (const auto& [reason, count] : analysis.table.missing) measured -= count;
  out += paragraph_text("Movement of " + counted(measured, "trial", "trials") + " of " +
                        std::to_string(trials.rows.size()) + ".");
  for (const auto& [reason, count] : analysis.table.missing)
    out += paragraph_text("Missing: " + counted(count, "trial", "trials") + ": " + reason + ".");
  for (std::size_t c = 0; c < analysis.measures.front().comparisons.size(); ++c)
    out += "\n" + table_text(measures_table(analysis, c));
  if (!analysis.gains.empty()) out += "\n" + table_text(gains_table(analysis));
  return out + "\n" + table_text(definitions_table());
}

std::string movement_json(const MovementAnalysis& analysis) {
  const TrialTable& trials = analysis.table.trials;
  Json out = {{"program_version", analysis.program_version},
              {"simulated", trials.simulated == Simulated::no    ? Json(false)
                            : trials.simulated == Simulated::yes ? Json(true)
                                                                 : Json("mixed")},
              {"settings",
               {{"cutoff_hz", analysis.table.settings.cutoff},
                {"coverage_places", TouchedSurface::kPlaces},
                {"coverage_reach_m", TouchedSurface::kReach},
                {"parts", TouchedSurface::kParts}}},
              {"protocol_sha256", trials.provenance.protocol_sha256},
              {"n_trials", trials.rows.size()}};
  out["missing"] = Json::object();
  for (const auto& [reason, count] : analysis.table.missing) out["missing"][reason] = count;
  for (const MeasureComparison& measure : analysis.measures)
    out["measures"][definition(measure.measure).name] = measure_json(analysis, measure);
  out["gain_beside_movement"] = Json::array();
  for (const AdjustedGain& gain : analysis.gains) {
    out["gain_beside_movement"].push_back(
        {{"shape", trials.shapes[gain.shape]},
         {"comparison", gain.comparison},
         {"measure", definition(gain.measure).name},
         {"n_trials", gain.n_trials},
         {"n_participants", gain.n_participants},
         {"log_time_difference", number(gain.time_difference)},
         {"measure_difference", number(gain.measure_difference)},
         {"log_time_difference_at_equal_measure", number(gain.time_difference_at_equal_measure)},
         {"log_time_by_measure", number(gain.slope)}});
  }
  return out.dump(2) + "\n";
}

}  // namespace palpate::analysis
