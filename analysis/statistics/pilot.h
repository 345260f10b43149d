#pragma once
// Estimates the model for sample size planning from a pilot study.

#include <string>
#include <vector>

#include "analysis/statistics/analysis.h"
#include "analysis/statistics/power.h"

namespace palpate::analysis {

/// Estimates from a pilot.
struct Pilot {
  RendererPair pair;      ///< the first comparison of the pilot
  std::string undefined;  ///< reason if there is no model; empty: there is one
  StudyModel model;       ///< effects as estimated in the pilot
  std::string label;      ///< from simulated_label(); empty: human participants
  std::vector<std::string> notes;
};

/// The parameters of the fitted mixed model, and the participant x shape standard deviation of
/// gains, which that model lacks: by moments from the mean differences of participants with all
/// cells (0 if residual variance explains them). If it is above 0, it is subtracted from the
/// variance of the random slope, which contains a part of it, and the residual variance is that
/// within cells.
Pilot read_pilot(const Analysis& analysis);

}  // namespace palpate::analysis
