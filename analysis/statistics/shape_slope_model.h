#pragma once
// Mixed model of log times with two renderers in which a participant's level and gain also differ
// between shapes: the model of mixed_model.h has only one level and one gain for each participant,
// and is too sure where gains differ between shapes.

#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/mixed_model.h"

namespace palpate::analysis {

/// log time = mean of renderer and shape + a + b r + c + g r, r = -1/2 (reference), +1/2. a and b
/// of each participant, correlated; c and g of each participant and shape, independent; REML,
/// Satterthwaite's degrees of freedom. g is taken out first, then c, if its SD is estimated as 0.
struct ShapeSlopeModel {
  std::string undefined;               ///< reason if there is no fit; empty: fitted
  std::vector<std::string> taken_out;  ///< in words; both: the model is that of mixed_model.h
  double participant_level_sd = 0, participant_gain_sd = 0;
  double shape_level_sd = 0, shape_gain_sd = 0, residual_sd = 0;
  double log_likelihood_reml = 0;
  std::vector<ModelEstimate>
      contrasts;  ///< of each shape, compared minus reference; p_holm over them

  bool has_shape_gains() const { return undefined.empty() && shape_gain_sd > 0; }
};

/// \param participant_cells  [renderer][shape][participant] of two renderers
ShapeSlopeModel shape_slope_model(const ParticipantCells& participant_cells);

}  // namespace palpate::analysis
