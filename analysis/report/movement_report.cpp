#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "analysis/figures/figures.h"
#include "analysis/movement/comparison.h"
#include "analysis/movement/pictures.h"
#include "analysis/report/html_page.h"
#include "analysis/report/inference_json.h"
#include "analysis/report/report.h"
#include "analysis/report/tables.h"
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
  return "Settings: low-pass filter of the path at " + fixed(analysis.table.settings.cutoff, 1) +
         " Hz; contacts from rendering each trial again, with forces identical to the bit.";
}

/// Four significant digits.
std::string four_digits(const std::optional<double>& value) {
  if (!value || !std::isfinite(*value)) return kMissing;
  const double size = std::abs(*value);
  const int before = size >= 1 ? static_cast<int>(std::floor(std::log10(size))) + 1 : 1;
  return fixed(*value, size < 0.1 ? 4 : std::max(0, 4 - before));
}

/// The mean over participants, transformed back from the scale.
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
  table.header = {"measure",      "shape",
                  pair.reference, pair.renderer,
                  "difference",   "95 % low",
                  "high",         "t",
                  "df",           holm_heading(analysis.table.trials.shapes.size()),
                  "model p"};
  for (const MeasureComparison& measure : analysis.measures) {
    for (std::size_t s = 0; s < analysis.table.trials.shapes.size(); ++s) {
      const PairedShape& shape = measure.comparisons[comparison].shapes[s];
      const auto& interval = shape.t_test.log_ratio_ci95;
      const ModelEstimate* model = model_contrast(measure, comparison, s);
      table.rows.push_back({definition(measure.measure).name, analysis.table.trials.shapes[s],
                            four_digits(mean_in_units(measure, pair.reference_at, s)),
                            four_digits(mean_in_units(measure, pair.renderer_at, s)),
                            four_digits(shape.mean_log_ratio),
                            four_digits(interval ? std::optional(interval->low) : std::nullopt),
                            four_digits(interval ? std::optional(interval->high) : std::nullopt),
                            number(shape.t_test.t, 2), number(shape.t_test.df, 0),
                            p_or_missing(shape.t_test.p_holm),
                            p_or_missing(model ? model->p_holm : std::nullopt)});
    }
  }
  table.notes.push_back(
      "Means over participants in SI units, transformed back from the scale of comparison; the "
      "difference is "
      "on that scale: log (lengths, speeds, times, forces), log of value + 1 (counts, rates), "
      "logit (shares, limited to 0.005 to 0.995), untransformed (sparc, ldlj). Paired t-tests over "
      "participants, p adjusted (Holm) over the shapes of a measure, not over measures.");
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
  table.caption = movement_caption(analysis, "Gain in time and differences of movement");
  table.n_names = 2;
  table.header = {"shape",          "measure",    "trials",
                  "log time",       "of measure", "time at equal measure",
                  "time by measure"};
  for (const AdjustedGain& gain : analysis.gains) {
    table.rows.push_back({analysis.table.trials.shapes[gain.shape], definition(gain.measure).name,
                          std::to_string(gain.n_trials), four_digits(gain.time_difference),
                          four_digits(gain.measure_difference),
                          four_digits(gain.time_difference_at_equal_measure),
                          four_digits(gain.slope)});
  }
  table.notes.push_back(
      "Correct trials, within participants. log time, of measure: difference between the "
      "renderers. time at equal measure: the difference of log time in a regression that has the "
      "measure and the renderer; time by measure: the measure's coefficient. The table describes "
      "which "
      "differences occur together; the movements were not manipulated.");
  table.notes.push_back(settings_note(analysis));
  return table;
}

/// A sentence for each shape: gain in time, also at equal coverage rate.
std::vector<std::string> gain_sentences(const MovementAnalysis& analysis) {
  std::vector<std::string> sentences;
  const auto percent = [](double log_ratio) { return 100 * (std::exp(log_ratio) - 1); };
  for (const AdjustedGain& gain : analysis.gains) {
    if (std::string_view(definition(gain.measure).name) != "coverage_rate" ||
        !gain.time_difference || !gain.time_difference_at_equal_measure) {
      continue;
    }
    const RendererPair& pair = analysis.measures.front().comparisons[gain.comparison].pair;
    const double change = percent(*gain.time_difference);
    sentences.push_back(printable(analysis.table.trials.shapes[gain.shape], 40) + ": " +
                        fixed(std::abs(change), 1) + " % " + (change < 0 ? "less" : "more") +
                        " time with " + printable(pair.renderer, 40) + " than with " +
                        printable(pair.reference, 40) + "; at equal coverage rate, " +
                        fixed(std::abs(percent(*gain.time_difference_at_equal_measure)), 1) +
                        " % " + (*gain.time_difference_at_equal_measure < 0 ? "less" : "more") +
                        ".");
  }
  return sentences;
}

constexpr const char* kHowToRead =
    "Each trial with servo samples was rendered again, which reproduced the recorded forces to the "
    "bit "
    "and gave the position of every contact. The path of the stylus tip, in the frame of the "
    "object, was "
    "smoothed with a zero-phase low-pass filter. The measures defined below were computed from "
    "path, contacts and forces, and compared between renderers in the same way as response times: "
    "participants' means on the measure's scale were compared by paired t-tests, with p "
    "adjusted (Holm) over the shapes of a measure, and by a mixed model. With so many measures "
    "some p are small by chance: choose the measures before the analysis.";

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

std::vector<std::string> movement_warnings(const TrialTable& trials) {
  std::vector<std::string> warnings = trials.warnings;
  if (trials.provenance.protocol_sha256.size() > 1)
    warnings.push_back(pooled_protocols(trials.provenance));
  return warnings;
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
  if (!label.empty())
    out += paragraph_text(label + ": the movements below are those of a model.") + "\n";
  std::size_t measured = trials.rows.size();
  for (const auto& [reason, count] : analysis.table.missing) measured -= count;
  out += paragraph_text("Movement of " + counted(measured, "trial", "trials") + " of " +
                        std::to_string(trials.rows.size()) + ".");
  for (const auto& [reason, count] : analysis.table.missing)
    out += paragraph_text("Missing: " + counted(count, "trial", "trials") + ": " + reason + ".");
  for (const std::string& warning : movement_warnings(trials))
    out += paragraph_text("Warning: " + printable(warning, 4000));
  for (std::size_t c = 0; c < analysis.measures.front().comparisons.size(); ++c)
    out += "\n" + table_text(measures_table(analysis, c));
  if (!analysis.gains.empty()) out += "\n" + table_text(gains_table(analysis));
  return out + "\n" + table_text(definitions_table());
}

std::string movement_html(const MovementAnalysis& analysis, const MovementPictures& pictures) {
  const TrialTable& trials = analysis.table.trials;
  const std::string label = simulated_label(trials.simulated);
  const std::string study = trials.provenance.protocol_name;
  HtmlPage page("Movements of the hand" + (study.empty() ? "" : ": " + printable(study, 200)),
                label);
  if (!label.empty())
    page.put_banner(label + ": the movements here are those of a model, not of humans.");
  std::size_t missing = 0;
  for (const auto& [reason, count] : analysis.table.missing) missing += count;
  page.below_title() +=
      "<p class=\"lead\">" + counted(trials.participants.size(), "participant", "participants") +
      ", " + counted(trials.rows.size() - missing, "trial", "trials") + " measured of " +
      std::to_string(trials.rows.size()) + ".</p>\n<p>" + escaped_sentence(kHowToRead) + "</p>\n";
  std::vector<std::string> reasons;
  for (const auto& [reason, count] : analysis.table.missing)
    reasons.push_back("Missing: " + counted(count, "trial", "trials") + ": " + reason + ".");
  put_list(page.below_title(), reasons);
  put_list(page.below_title(), movement_warnings(trials));
  for (const Figure& figure : movement_figures(analysis.table, pictures)) {
    std::string link = figure.id.substr(figure.id.find('-') + 1);  // "paths"
    link.front() = static_cast<char>(std::toupper(link.front()));
    page.put_figure_section(figure, link);
  }
  if (!pictures.typical.empty() && !trials.provenance.source.empty()) {
    std::string trial_options;
    for (const TypicalTrial& one : pictures.typical) {
      if (trials.rows[one.row].shape != trials.rows[pictures.typical.front().row].shape) break;
      trial_options += " --trial " + one.name;
    }
    page.put_note(
        "To play back a trial, here the first of the paths: palpate watch "
        "--db " +
        printable(trials.provenance.source, 400) + trial_options + " --out trial.html");
  }
  if (!analysis.gains.empty()) {
    page.begin_section("gain", "Gain in time and differences of movement", "Gain");
    page.body() +=
        "<p>Does the hand move differently if a shape is identified in less time? For each shape "
        "the "
        "table gives the difference of time between the renderers, the difference of a measure, "
        "and "
        "the remaining difference of time between trials of equal measure. It describes which "
        "differences "
        "occur together. The movements were not manipulated, so it does not show which of them "
        "is the cause.</p>\n";
    put_list(page.body(), gain_sentences(analysis));
    put_table(page.body(), gains_table(analysis));
    page.end_section();
  }
  page.begin_section("measures", "Measures by shape and renderer", "Measures");
  for (std::size_t c = 0; c < analysis.measures.front().comparisons.size(); ++c)
    put_table(page.body(), measures_table(analysis, c));
  put_collapsible_tables(page.body(), "Definitions of the measures", {definitions_table()});
  page.end_section();
  page.begin_section("source", "Source and settings", "Source");
  Table source;
  source.caption = movement_caption(analysis, "Source");
  source.header = {"what", "value"};
  source.n_names = 2;
  const auto add = [&](const char* what, const std::string& value) {
    if (!value.empty()) source.rows.push_back({what, printable(value, 400)});
  };
  add("database", trials.provenance.source);
  add("protocol", trials.provenance.protocol_name);
  for (const std::string& sha256 : trials.provenance.protocol_sha256)
    add("protocol SHA-256", sha256);
  for (const std::string& version : trials.provenance.program_versions)
    add("recorded by palpate", version);
  add("simulated participants' settings SHA-256", trials.provenance.observer_sha256);
  add("low-pass filter of the path", fixed(analysis.table.settings.cutoff, 1) + " Hz");
  add("coverage", std::to_string(TouchedSurface::kPlaces) + " places, within " +
                      fixed(1000 * TouchedSurface::kReach, 0) + " mm");
  put_table(page.body(), source);
  page.end_section();
  return page.html("palpate " + analysis.program_version + ".");
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
              {"warnings", movement_warnings(trials)},
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
