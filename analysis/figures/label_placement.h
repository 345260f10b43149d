#pragma once
// Places the labels of data points where they overlap least.

#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// The panel's labels (Mark::Kind::label) as texts beside their points: each, in order, at the
/// candidate position (right or left, several heights) that overlaps the fewest points, intervals,
/// lines and labels placed before. \param width px, of the panel as it is drawn
std::vector<Mark> placed_labels(const Panel& panel, double width);

}  // namespace palpate::analysis
