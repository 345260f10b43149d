#pragma once
// Two-way repeated-measures analysis of variance, renderer x shape, on participants' mean log times
// (natural log of s).

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {

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

}  // namespace palpate::analysis
