#include "analysis/movement/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace palpate::analysis {
namespace {

/// One trial's values, or a participant's sums.
struct Observation {
  double time = 0, renderer = 0, measure = 0;
};

AdjustedGain gain_of(const std::map<std::uint32_t, std::vector<Observation>>& by_participant) {
  AdjustedGain gain;
  double rr = 0, rm = 0, mm = 0, rt = 0, mt = 0;
  for (const auto& [participant, trials] : by_participant) {
    Observation centre;
    for (const Observation& one : trials) {
      centre.time += one.time;
      centre.renderer += one.renderer;
      centre.measure += one.measure;
    }
    const auto n = static_cast<double>(trials.size());
    if (centre.renderer == 0 || centre.renderer == n) continue;  // lacks one of the renderers
    ++gain.n_participants;
    gain.n_trials += trials.size();
    for (const Observation& one : trials) {
      const double t = one.time - centre.time / n, r = one.renderer - centre.renderer / n,
                   m = one.measure - centre.measure / n;
      rr += r * r;
      rm += r * m;
      mm += m * m;
      rt += r * t;
      mt += m * t;
    }
  }
  if (!(rr > 0)) return gain;
  gain.time_difference = rt / rr;
  gain.measure_difference = rm / rr;
  const double determinant = rr * mm - rm * rm;
  if (!(determinant > 1e-9 * rr * mm)) return gain;
  gain.time_difference_at_equal_measure = (mm * rt - rm * mt) / determinant;
  gain.slope = (rr * mt - rm * rt) / determinant;
  return gain;
}

constexpr double kLeastShare = 0.005;

}  // namespace

std::vector<AdjustedGain> adjusted_gains(const MovementTable& table) {
  static constexpr std::array<const char*, 3> kNames = {"coverage_rate", "strokes",
                                                        "contact_share"};
  std::vector<AdjustedGain> gains;
  const std::vector<RendererPair> pairs = renderer_pairs(table.trials.renderers);
  for (std::size_t c = 0; c < pairs.size(); ++c) {
    if (!pairs[c].in_data()) continue;
    for (std::size_t s = 0; s < table.trials.shapes.size(); ++s) {
      for (const char* name : kNames) {
        const std::size_t m = measure_named(name);
        std::map<std::uint32_t, std::vector<Observation>> by_participant;
        for (std::size_t i = 0; i < table.values.size(); ++i) {
          const TrialRow& row = table.trials.rows[i];
          const bool reference = row.renderer == *pairs[c].reference_at;
          if (row.shape != s || (!reference && row.renderer != *pairs[c].renderer_at)) continue;
          const auto value = on_scale(measure_definitions()[m].scale, table.values[i][m]);
          if (!row.correct || !value || !(row.response_time > 0)) continue;
          by_participant[row.participant].push_back(
              {std::log(row.response_time), reference ? 0.0 : 1.0, *value});
        }
        AdjustedGain gain = gain_of(by_participant);
        gain.shape = s;
        gain.comparison = c;
        gain.measure = m;
        gains.push_back(gain);
      }
    }
  }
  return gains;
}

std::optional<double> on_scale(MeasureScale scale, const std::optional<double>& value) {
  if (!value) return std::nullopt;
  switch (scale) {
    case MeasureScale::log:
      return *value > 0 ? std::optional(std::log(*value)) : std::nullopt;
    case MeasureScale::count:
      return *value >= 0 ? std::optional(std::log1p(*value)) : std::nullopt;
    case MeasureScale::logit: {
      const double share = std::clamp(*value, kLeastShare, 1 - kLeastShare);
      return std::log(share / (1 - share));
    }
    case MeasureScale::identity:
      break;
  }
  return value;
}

double from_scale(MeasureScale scale, double value) {
  switch (scale) {
    case MeasureScale::log:
      return std::exp(value);
    case MeasureScale::count:
      return std::expm1(value);
    case MeasureScale::logit:
      return 1 / (1 + std::exp(-value));
    case MeasureScale::identity:
      break;
  }
  return value;
}

const char* scale_name(MeasureScale scale) {
  switch (scale) {
    case MeasureScale::log:
      return "log";
    case MeasureScale::count:
      return "log of value + 1";
    case MeasureScale::logit:
      return "logit";
    case MeasureScale::identity:
      break;
  }
  return "value";
}

std::vector<MeasureComparison> compare_movement(const MovementTable& table) {
  std::vector<MeasureComparison> all;
  for (std::size_t m = 0; m < kMeasures; ++m) {
    const MeasureScale scale = measure_definitions()[m].scale;
    // Times are compared by their logs: pass the value on its scale as the log of a time.
    TrialTable trials = table.trials;
    std::vector<TrialRow> rows;
    for (std::size_t i = 0; i < trials.rows.size(); ++i) {
      const std::optional<double> value = on_scale(scale, table.values[i][m]);
      if (!value || std::abs(*value) > 600) continue;
      TrialRow row = trials.rows[i];
      row.correct = true;
      row.timed_out = false;
      row.response_time = std::exp(*value);
      rows.push_back(row);
    }
    trials.rows = std::move(rows);
    MeasureComparison found;
    found.measure = m;
    found.description = describe(trials, std::numeric_limits<double>::min());
    std::vector<PairedShape*> tests;
    for (const RendererPair& pair : renderer_pairs(trials.renderers)) {
      Comparison comparison;
      comparison.pair = pair;
      comparison.shapes = compare_by_shape(trials, found.description, pair);
      found.comparisons.push_back(std::move(comparison));
    }
    for (Comparison& comparison : found.comparisons) {
      for (PairedShape& shape : comparison.shapes) tests.push_back(&shape);
    }
    adjust_all(tests);
    found.mixed_model =
        mixed_model(found.description.participant_cells, trials.renderers, trials.shapes);
    all.push_back(std::move(found));
  }
  return all;
}

}  // namespace palpate::analysis
