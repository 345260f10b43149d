#pragma once

#include <functional>
#include <string>
#include <vector>

namespace palpate::runner {

/// m x'' = -b x' - k x + F, F held over each tick: what moves in this program.
struct Oscillator {
  std::string name;
  double mass = 0.1, damping = 0, stiffness = 0;  ///< kg, N s/m, N/m
};

/// One way to go from tick to tick.
struct IntegratorRow {
  std::string oscillator, method;  ///< explicit, semi-implicit, implicit, exact
  int steps = 1;                   ///< a tick
  double ns_per_tick = 0;
  /// m, the worst over 500 ticks of a force that changes at each, against the closed form in
  /// extended precision; infinity where it blew up.
  double error = 0;
};

/// Each method at 1 kHz with 1 to 1024 steps a tick (exact: 1), on three oscillators: a hand at
/// ease, a stiff one, one that is overdamped.
/// \param now_ns  a clock
std::vector<IntegratorRow> compare_integrators(const std::function<double()>& now_ns);

}  // namespace palpate::runner
