#pragma once

#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// The panel's labels as texts beside their points: right or left, above or below, wherever they
/// hide least of each other and of points, bars and lines.
/// \param width px, that the panel is drawn with
std::vector<Mark> placed_labels(const Panel& panel, double width);

}  // namespace palpate::analysis
