#pragma once
// What is kept of the frames in which a trial was seen.

#include <optional>
#include <vector>

#include "data/record.h"
#include "runner/display/display.h"

namespace palpate::runner::participants {

/// None: there were no frames. \param delay  s, intended
std::optional<data::SeenRecord> seen_record(const std::vector<display::SeenFrame>& frames,
                                            double delay);

}  // namespace palpate::runner::participants
