#pragma once
// Linear mixed model log(response_time) ~ renderer * shape + (1 + renderer | participant) by
// restricted maximum likelihood (REML), like R's lme4 (Bates et al. 2015) and lmerTest (Kuznetsova
// et al. 2017).

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/model_estimate.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// A fixed effect in treatment coding.
struct FixedEffect {
  std::string name;  ///< as in R: "(Intercept)", "rendererray", "rendererray:shapecone"
  ModelEstimate value;
};

/// The fitted model.
struct MixedModel {
  std::string undefined;  ///< reason if there is no fit; empty: fitted
  std::string singular;   ///< parameters on the boundary of the parameter space; empty: none
  std::size_t n_observations = 0, n_participants = 0;
  std::optional<double> log_likelihood_reml;
  /// Treatment coding with the first renderer and the first shape as reference levels, without
  /// `left_out`.
  std::vector<FixedEffect> fixed_effects;
  std::vector<std::string>
      left_out;  ///< coefficients that cannot be estimated because of empty cells
  std::optional<double> residual_sd;
  /// Standard deviations of participants' intercepts and of the slopes of each further renderer.
  std::vector<double> random_sds;
  /// Their correlations, below the diagonal by rows; none: a standard deviation is 0.
  std::vector<std::optional<double>> random_correlations;
  /// [renderer - 1][shape]: each further renderer minus the first.
  std::vector<std::vector<ModelEstimate>> contrasts;
};

/// Fits the model: global optimum of the REML criterion by Newton's method with exact derivatives
/// from several starting values; on the boundary the Karush-Kuhn-Tucker conditions are checked. Not
/// fitted (would take hours): more than 8 renderers, or more work than 200 shapes with two
/// renderers. \param participant_cells as of describe() \param renderers, shapes names of the
/// levels
MixedModel mixed_model(const ParticipantCells& participant_cells,
                       const std::vector<std::string>& renderers,
                       const std::vector<std::string>& shapes);

}  // namespace palpate::analysis
