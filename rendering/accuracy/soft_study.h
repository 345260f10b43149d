#pragma once
// Errors of soft bodies against known solutions, and the cost of a step. Not for the servo.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace palpate::rendering {

/// One measured quantity of one solid.
struct SoftRow {
  std::string name, truth;
  std::size_t nodes = 0, elements = 0;
  double value = 0, reference = 0;  ///< in `unit`; the error is their difference
  std::string unit;
  double error = 0;    ///< share of the reference; in `unit` for the last two cases
  double step_ns = 0;  ///< of a step of the body; 0: no step
};

/// \param quick  without the meshes that take seconds to build
/// \param now    ns, a clock
std::vector<SoftRow> soft_study(bool quick, const std::function<double()>& now,
                                const std::function<void(double)>& progress);

}  // namespace palpate::rendering
