#pragma once
// Reading of what a participant can answer in a block.

#include "protocols/object_reader.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads keys, scale or range, and confidence of a block whose task has been read. Every answer of
/// the task has one key; keys that the block does not say are 1, 2, ... in order.
void read_answers(ObjectReader& reader, const Protocol& protocol, TaskBlock& block);

}  // namespace palpate::protocols
