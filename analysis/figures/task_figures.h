#pragma once

#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {

/// For each stimulus in a block with means over participants: "group1", ...: a panel for each
/// measure with every participant, the mean and its 95 % interval, by renderer. For each cell with
/// psychometric functions: "function1", ...: a panel for each participant with the share of
/// successes at each level (area of the symbol: trials), the fitted function and the threshold's
/// interval; and "track1", ...: levels over the trials of up to four tracks with the answers, and
/// reversals of a staircase. Participants beyond the first 12 are left out, with a note.
std::vector<Figure> task_figures(const TaskAnalysis& analysis);

}  // namespace palpate::analysis
