#pragma once
// Record of the frames in which a trial was seen.

#include <optional>
#include <vector>

#include "data/record.h"

namespace palpate::runner::participants {

/// None: there were no frames.
std::optional<data::SeenRecord> seen_record(const std::vector<data::FrameRecord>& frames);

}  // namespace palpate::runner::participants
