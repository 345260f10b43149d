#pragma once
// Compares integrators for the simulated hand, to justify the exact one.

#include <functional>
#include <string>
#include <vector>

namespace palpate::runner::evidence {

/// m x'' = -b x' - k x + F with F held over each tick, the equation of the program's simulated
/// hand.
struct Oscillator {
  std::string name;
  double mass = 0.1, damping = 0, stiffness = 0;  ///< kg, N s/m, N/m
};

/// Accuracy and cost of one integrator.
struct IntegratorRow {
  std::string oscillator, method;  ///< explicit, semi-implicit, implicit, exact
  int steps = 1;                   ///< a tick
  double ns_per_tick = 0;
  /// m, largest over 500 ticks with a random force at each, against the closed form in extended
  /// precision; infinite: it diverged.
  double error = 0;
};

/// Each method at 1 kHz with 1 to 1024 steps a tick (exact: 1), on three oscillators: a relaxed
/// hand, a stiff one and an overdamped one. \param now_ns  a clock
std::vector<IntegratorRow> compare_integrators(const std::function<double()>& now_ns);

}  // namespace palpate::runner::evidence
