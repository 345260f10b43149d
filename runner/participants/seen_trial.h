#pragma once
// The view of an interval, from the protocol.

#include <memory>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/display/seen.h"

namespace palpate::runner::participants {

/// Null: nothing of the interval is seen.
std::shared_ptr<const display::SeenTrial> seen_trial_of(const protocols::Protocol& protocol,
                                                        const protocols::Trial& trial,
                                                        const protocols::Interval& interval);

}  // namespace palpate::runner::participants
