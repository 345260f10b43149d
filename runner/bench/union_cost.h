#pragma once
// Run time of ticks over an object of many convex parts with a tool of several segments: rows of
// `palpate bench`. Of runner/bench alone.

#include <cstddef>
#include <functional>

#include "runner/bench/tick_cost.h"
#include "runner/bench/tick_timer.h"

namespace palpate::runner {

inline constexpr std::size_t kUnionCosts = 7;  ///< rows

/// Ten balls of 30 mm in a ring that overlap, one object, and a cross under the stylus that lies on
/// them and turns, 1 to 2 mm deep, at 0.1 m/s: of all fineness, with 990 more balls out of reach,
/// with one segment, and with one ball.
void measure_union_costs(TickTimer& timer, std::size_t ticks,
                         const std::function<void(TickCost)>& keep);

}  // namespace palpate::runner
