#pragma once
// The order of stimuli within a block, under limits on repetition.

#include <cstddef>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "stimuli/random.h"

namespace palpate::protocols {

/// How many single draws order_block may spend on plain random orders before it constructs one.
std::size_t uniform_draw_budget(std::size_t trials);

/// An order of stimuli 0, 1, ..., each shown counts[i] times. Holds the limits for sure and ends
/// for sure, or throws before anything is drawn.
///
/// Sequential: 0, 1, ..., 0, 1, ... as long as each lasts.
/// Random: first plain random orders are drawn and the first that holds the limits is taken, so
/// that every valid order is equally likely; without limits this is always the first. Where the
/// budget of draws ends before one was found (limits that nearly no plain order holds, such as no
/// repeats among 76 trials of 4 stimuli), an order is constructed: each next stimulus is drawn with
/// a probability proportional to what remains of it, among those after which the rest can still be
/// completed; then pairs of trials are swapped at random where the limits allow it. Such orders are
/// valid for sure and very nearly, not exactly, equally likely: in cases small enough to count, the
/// difference drowns in the sampling error of 200 draws an order.
///
/// \throws ScheduleError naming the stimulus (by `names`) and what would help.
std::vector<int> order_block(const std::vector<int>& counts, const Protocol::Order& order,
                             const std::vector<std::string>& names, stimuli::Random& random);

/// The same with another budget; 0 always constructs.
std::vector<int> order_block(const std::vector<int>& counts, const Protocol::Order& order,
                             const std::vector<std::string>& names, stimuli::Random& random,
                             std::size_t draw_budget);

/// Whether any order of these counts holds the limits. Exact.
bool can_order(const std::vector<int>& counts, const Protocol::Order& order);

}  // namespace palpate::protocols
