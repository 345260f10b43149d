#pragma once
// Counterbalancing of conditions over participants.

#include <vector>

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

}  // namespace palpate::protocols
