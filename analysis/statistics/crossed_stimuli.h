#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/study_table.h"

namespace palpate::analysis {

/// The factors that these stimuli cross completely, and what they cross: the index of each cell's
/// stimulus, the last factor's levels innermost, the plain stimuli innermost of all.
struct CrossedStimuli {
  std::vector<StudyFactor> factors;
  std::vector<std::string> plain;
  std::vector<std::size_t> cells;
};

/// none: they cross nothing, or not completely.
std::optional<CrossedStimuli> crossed_stimuli(const std::vector<std::string>& stimuli,
                                              const std::vector<StudyFactor>& all);

}  // namespace palpate::analysis
