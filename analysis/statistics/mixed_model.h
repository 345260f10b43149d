#pragma once
// log(response_time) ~ renderer * shape + (1 + renderer | participant), by REML.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// One coefficient or contrast with Satterthwaite's degrees of freedom. Natural log of seconds.
struct ModelEstimate {
  std::string undefined;  ///< why it cannot be estimated, or tested; empty: all is there
  std::optional<double> estimate, se, df_satterthwaite, t, p;
  std::optional<Interval> ci95;
  std::optional<double> p_holm;  ///< contrasts only: over all of them
};

struct FixedEffect {
  std::string name;  ///< as R prints it: "(Intercept)", "rendererray", "rendererray:shapecone"
  ModelEstimate value;
};

struct MixedModel {
  std::string undefined;  ///< why there is no fit; empty: there is
  std::string singular;   ///< what lies on the boundary of the parameter space; empty: nothing
  std::size_t n_observations = 0, n_participants = 0;
  std::optional<double> log_likelihood_reml;
  /// Treatment coding, first renderer and first shape as reference. Those of `left_out` are not
  /// among them.
  std::vector<FixedEffect> fixed_effects;
  std::vector<std::string> left_out;  ///< coefficients that empty cells leave without an estimate
  std::optional<double> residual_sd;
  /// Of the participants' intercept, then of the slope of each further renderer.
  std::vector<double> random_sds;
  /// Correlations of them, row by row below the diagonal; none where an sd is 0.
  std::vector<std::optional<double>> random_correlations;
  /// [renderer - 1][shape]: each further renderer minus the first. With point and ray:
  /// contrasts[0].
  std::vector<std::vector<ModelEstimate>> contrasts;
};

/// The true optimum of the REML criterion: Newton's method with exact derivatives from several
/// starts, on the boundary with the Karush-Kuhn-Tucker condition checked.
/// Refuses what would take hours: more than 8 renderers, or so many shapes with them that their
/// cells' matrices are larger than those of 200 shapes with two renderers.
/// \param people as describe() gives it; \param renderers, shapes names of the levels
MixedModel mixed_model(const People& people, const std::vector<std::string>& renderers,
                       const std::vector<std::string>& shapes);

}  // namespace palpate::analysis
