#pragma once
// Models of times within participants: analysis of variance and linear mixed model.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/model_estimate.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

// Two-way repeated-measures analysis of variance, renderer x shape, on participants' mean log times
// (natural log of s).

/// Test of sphericity of an effect's contrasts, and the corrected p values.
struct Sphericity {
  /// Reason for missing values; empty: all are defined. With one degree of freedom sphericity holds
  /// trivially and all are missing.
  std::string undefined;
  std::optional<double> mauchly_w;  ///< W = det S / (tr S / p)^p; Mauchly (1940)
  /// By the chi-squared series of Box (1949) to second order. mauchly_p_box: as in Box; mauchly_p:
  /// as in R's afex and car, which once use the number of cells in place of Box's number of
  /// contrasts.
  std::optional<double> mauchly_p, mauchly_p_box;
  std::optional<double> gg_epsilon, gg_p;                       ///< Greenhouse & Geisser (1959)
  std::optional<double> hf_epsilon_raw, hf_epsilon_used, hf_p;  ///< Huynh & Feldt (1976); used <= 1
};

/// F test of a main effect or the interaction.
struct AnovaEffect {
  std::string name;       ///< "renderer", "shape", "renderer:shape"
  std::string undefined;  ///< reason if F is missing; empty: defined
  std::optional<double> num_df, den_df, f, p;
  /// SS / (SS + SS_participants + all three error SS); Olejnik & Algina (2003).
  std::optional<double> generalized_eta_squared;
  Sphericity sphericity;
};

/// The analysis of variance.
struct RmAnova {
  std::string
      undefined;  ///< reason if there is no two-way analysis; single effects may still be defined
  std::size_t n_participants_used = 0;
  std::array<AnovaEffect, 3> effects;  ///< renderer, shape, renderer:shape
  std::vector<std::size_t> dropped;    ///< participants without a time in some cell
};

/// Analyses the participants with a time in every cell; any numbers of renderers and shapes.
RmAnova rm_anova(const ParticipantCells& participant_cells);

// Linear mixed model log(response_time) ~ renderer * shape + (1 + renderer | participant) by
// restricted maximum likelihood (REML), like R's lme4 (Bates et al. 2015) and lmerTest (Kuznetsova
// et al. 2017).

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
