#pragma once
// The trials of a block whose levels do not follow from the answers.

#include <cstdint>
#include <vector>

#include "protocols/schedule.h"

namespace palpate::protocols {

/// In an order by chance under the limits of the block. \param index  of the block
/// \param round  of practice with a criterion, from 0. \throws ScheduleError
std::vector<Trial> fixed_trials(const Protocol& protocol, int participant, int index,
                                std::uint64_t round = 0);

/// Identification as version 1 has it, whose order it then has: whatever is the same in two
/// protocols gives the same trials. Limits on the order of several renderers are of other things.
bool has_order_of_version_1(const TaskBlock& block);
/// What of a protocol of version 1 an order follows from. \param block  none: all stimuli
Protocol version_1_view(const Protocol& protocol, const TaskBlock* block);
/// Practice has its orientations, main trials get theirs from version_1_view of the whole.
std::vector<Trial> trials_of_version_1(const Protocol& protocol, int participant, int index,
                                       int round = 0);

}  // namespace palpate::protocols
