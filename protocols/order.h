#pragma once
// The order of stimuli within a block, under limits on repetition (max_run, min_distance), and of
// conditions over participants (counterbalancing).

#include <cstddef>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Number of rows of a balanced Latin square of n conditions: n where n is even, 2 n
/// where it is odd (1 for a single condition).
int latin_square_rows(int n);

/// The order of conditions 0 .. n-1 for participant 1, 2, ...: a row of the balanced Latin square
/// of Williams (1949), "Experimental designs balanced for the estimation of residual effects of
/// treatments". Over latin_square_rows(n) successive participants every condition stands in every
/// position equally often and follows every other condition equally often.
/// \throws std::invalid_argument unless n >= 1 and participant_number >= 1.
std::vector<int> latin_square_row(int n, int participant_number);

/// The number of draws that order_block may spend on rejection sampling before it constructs an
/// order.
std::size_t uniform_draw_budget(std::size_t trials);

/// An order of stimuli 0, 1, ..., each shown counts[i] times. Always satisfies the limits and
/// always terminates, or throws before anything is drawn.
///
/// Sequential: 0, 1, ..., 0, 1, ... while each lasts.
/// Random: rejection sampling. Unconstrained random orders are drawn until one satisfies the
/// limits, so that every valid order is equally likely; without limits this is the first. Where the
/// budget of draws is spent before that (limits that almost no order satisfies, such as no repeats
/// among 76 trials of 4 stimuli), an order is constructed: each next stimulus is drawn with a
/// probability proportional to its remaining trials, among those after which the rest can still be
/// completed; then pairs of trials are swapped at random where the limits allow it. Such orders are
/// valid, and nearly but not exactly equally likely: in cases small enough to count, the difference
/// is within the sampling error of 200 draws for each order.
///
/// \throws ScheduleError naming the stimulus (by `names`) and what can be changed.
std::vector<int> order_block(const std::vector<int>& counts, const Protocol::Order& order,
                             const std::vector<std::string>& names, Random& random);

/// The same with another budget; 0 always constructs.
std::vector<int> order_block(const std::vector<int>& counts, const Protocol::Order& order,
                             const std::vector<std::string>& names, Random& random,
                             std::size_t draw_budget);

/// Whether any order of these counts satisfies the limits. Exact.
bool can_order(const std::vector<int>& counts, const Protocol::Order& order);

}  // namespace palpate::protocols
