#include "analysis/movement/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate::analysis {
namespace {

constexpr double kLeastShare = 0.005;

}  // namespace

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
    // Times are compared by their logs: the value on its scale goes in as the log of a time.
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
