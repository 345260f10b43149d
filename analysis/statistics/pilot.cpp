#include "analysis/statistics/pilot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/mixed_model.h"
#include "analysis/statistics/paired.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

struct ShapeGain {
  bool known = false;
  double variance = 0;  ///< >= 0
};

/// Variance of log times within participants' cells; `otherwise` if no cell has two trials.
double variance_in_cells(const ParticipantCells& participant_cells, double otherwise) {
  double squares = 0, freedom = 0;
  for (const auto& renderer : participant_cells) {
    for (const auto& shape : renderer) {
      for (const ParticipantCell& cell : shape) {
        if (cell.n_used < 2) continue;
        squares += cell.sum_of_squares_log;
        freedom += static_cast<double>(cell.n_used - 1);
      }
    }
  }
  return freedom > 0 ? squares / freedom : otherwise;
}

/// Variance of the participant x shape interaction of differences renderer - reference, without the
/// part of residual variance.
ShapeGain shape_gain(const ParticipantCells& participant_cells, const RendererPair& pair,
                     double residual_variance) {
  const std::size_t n_shapes = participant_cells[0].size(),
                    n_participants = participant_cells[0][0].size();
  std::vector<std::vector<double>> rows;
  double noise = 0;
  for (std::size_t p = 0; p < n_participants; ++p) {
    std::vector<double> row;
    double own = 0;
    for (std::size_t s = 0; s < n_shapes; ++s) {
      const ParticipantCell &a = participant_cells[*pair.reference_at][s][p],
                            &b = participant_cells[*pair.renderer_at][s][p];
      if (a.n_used == 0 || b.n_used == 0) break;
      row.push_back(b.mean_log - a.mean_log);
      own += 1 / static_cast<double>(a.n_used) + 1 / static_cast<double>(b.n_used);
    }
    if (row.size() < n_shapes) continue;
    rows.push_back(std::move(row));
    noise += own;
  }
  ShapeGain out;
  if (rows.size() < 2 || n_shapes < 2) return out;
  const auto n = static_cast<double>(rows.size()), k = static_cast<double>(n_shapes);
  std::vector<double> of_shape(n_shapes);
  for (const auto& row : rows) {
    for (std::size_t s = 0; s < n_shapes; ++s) of_shape[s] += row[s] / n;
  }
  double squares = 0;
  for (const auto& row : rows) {
    const double own = mean(row) - mean(of_shape);
    for (std::size_t s = 0; s < n_shapes; ++s) {
      squares += (row[s] - of_shape[s] - own) * (row[s] - of_shape[s] - own);
    }
  }
  out.known = true;
  out.variance = std::max(0.0, squares / ((n - 1) * (k - 1)) - residual_variance * noise / (n * k));
  return out;
}

}  // namespace

Pilot read_pilot(const Analysis& analysis) {
  Pilot out;
  const MixedModel& fit = analysis.mixed_model;
  out.pair = analysis.comparisons.front().pair;
  out.undefined = fit.undefined;
  if (!out.undefined.empty()) return out;
  StudyModel& model = out.model;
  model.shapes = analysis.table.shapes;
  for (const ModelEstimate& contrast : fit.contrasts.front()) {
    model.log_ratios.push_back(contrast.estimate.value_or(0));
  }
  model.intercept_sd = fit.random_sds[0];
  model.gain_sd = fit.random_sds[1];
  model.correlation = fit.random_correlations[0].value_or(0);
  model.residual_sd = *fit.residual_sd;
  const Counts& counts = analysis.description.counts;
  model.proportion_used =
      static_cast<double>(counts.n_used_for_times) / static_cast<double>(counts.n_trials);

  const double in_cells = variance_in_cells(analysis.description.participant_cells,
                                            model.residual_sd * model.residual_sd);
  const ShapeGain extra = shape_gain(analysis.description.participant_cells, out.pair, in_cells);
  if (extra.known) {
    const auto k = static_cast<double>(model.shapes.size());
    model.shape_gain_sd = std::sqrt(extra.variance);
    if (extra.variance > 0) model.residual_sd = std::sqrt(in_cells);
    model.gain_sd = std::sqrt(std::max(0.0, model.gain_sd * model.gain_sd - extra.variance / k));
  } else {
    out.notes.push_back(
        "Participants' gains for single shapes cannot be separated from the common gain in this "
        "pilot: "
        "they are taken as 0, which makes the power too high if they vary.");
  }
  if (!fit.singular.empty()) {
    out.notes.push_back("The pilot's fit is singular (" + fit.singular +
                        "): its standard deviations are imprecise.");
  }
  if (fit.n_participants < 10) {
    constexpr double kShownAsNothing = 0.0005;  // three decimals
    out.notes.push_back(
        "Standard deviations from " + counted(fit.n_participants, "participant", "participants") +
        " are imprecise: also try " +
        (model.gain_sd < kShownAsNothing
             ? "--gain-sd 0.1 (gains that differ by some 10 %), as this pilot's is 0."
             : "a --gain-sd 1.5 times as large."));
  }
  if (analysis.comparisons.size() > 1) {
    out.notes.push_back("The pilot has " + std::to_string(analysis.table.renderers.size()) +
                        " renderers: this plan covers " + difference_name(out.pair) +
                        " only, with Holm's adjustment over its shapes; a study of all of them "
                        "adjusts over more tests and needs more participants.");
  }
  out.label = simulated_label(analysis.table.simulated);
  if (!out.label.empty()) out.notes.push_back(out.label + " in the pilot.");
  return out;
}

}  // namespace palpate::analysis
