#pragma once
// What a pilot says about a study to come.

#include <string>
#include <vector>

#include "analysis/statistics/analysis.h"
#include "analysis/statistics/power.h"

namespace palpate::analysis {

struct Pilot {
  RendererPair pair;      ///< that it is a pilot of: the study's first comparison
  std::string undefined;  ///< why nothing can be drawn from it; empty: something can
  StudyModel model;       ///< its effects are what the pilot found
  std::string label;      ///< "SIMULATED PARTICIPANTS" and the like; empty: people
  std::vector<std::string> notes;
};

/// The fitted mixed model, and what it leaves out: the standard deviation of a participant's gain
/// for a shape beyond the gain common to all, by moments from the participants' mean differences
/// (complete ones; 0 where chance alone explains them). Where there is some, the random slope and
/// the residual of the fit hold a part of it each: it is taken out of the slope, and the residual
/// is that within the cells.
Pilot read_pilot(const Analysis& analysis);

}  // namespace palpate::analysis
