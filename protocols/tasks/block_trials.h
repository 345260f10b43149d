#pragma once
// The trials of a block whose levels do not follow from the answers.
//
// Identification without levels and factors has the order and orientations of the study of shapes
// for the same design (schedule.h), if a block has one renderer, or several without limits on the
// order. Other blocks have a random order under the limits of the block.

#include <cstdint>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::protocols {

/// The trials of a block in order, with their orientations.
/// \param index  of the block
/// \param round  of practice with a criterion, from 0
/// \throws ScheduleError
std::vector<Trial> trials_of_block(const Protocol& protocol, int participant, int index,
                                   std::uint64_t round = 0);

/// The orientation of trial `shown` (from 0, through all rounds) of a block without the order of
/// shapes.
Quat orientation_in_block(const Protocol& protocol, int participant, std::uint64_t block,
                          std::size_t shown);

/// \throws ScheduleError: the limits on the order of its trials cannot be met
void check_order(const Protocol& protocol, int block);

}  // namespace palpate::protocols
