#include "runner/servo/field_demand.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rendering/fields.h"

namespace palpate::runner::servo {
namespace {

using DemandedKind = stimuli::FieldSpec::Kind;

/// N s/m, the largest sum of a row: at least the largest eigenvalue.
double size_of(const Mat3& b) {
  double most = 0;
  for (int row = 0; row < 3; ++row)
    most = std::max(most, std::abs(b[0][row]) + std::abs(b[1][row]) + std::abs(b[2][row]));
  return most;
}

/// N s/m, the largest power by the square of the speed that is seen, over circles of all speeds of
/// turn up to half of the rate.
double curl_demand(double damping, double low_pass, double period) {
  constexpr int kTurns = 400;
  double most = 0;
  for (int i = 1; i < kTurns; ++i) {
    const double turn = std::numbers::pi * i / kTurns / period;
    const double seen = std::sin(0.5 * turn * period) / (0.5 * turn * period);
    most =
        std::max(most, rendering::curl_power(damping, 1, turn, period, low_pass) / (seen * seen));
  }
  return most;
}

}  // namespace

FieldDemand demand_of(const std::vector<stimuli::FieldSpec>& fields, double rate,
                      double resolution) {
  FieldDemand out;
  for (const stimuli::FieldSpec& field : fields) {
    const double alpha = rendering::low_pass_share(1 / rate, field.low_pass);
    if (field.kind == DemandedKind::spring || field.kind == DemandedKind::channel)
      out.stiffness += field.stiffness;
    if (field.kind != DemandedKind::viscous && field.kind != DemandedKind::curl) continue;
    const double size = field.kind == DemandedKind::viscous ? size_of(field.damping)
                                                            : std::abs(field.damping[0][0]);
    if (field.kind == DemandedKind::viscous)
      out.damping += size * alpha / (2 - alpha);
    else if (!field.destabilising)
      out.damping += curl_demand(size, field.low_pass, 1 / rate);
    out.noise += size * alpha * resolution * rate;
  }
  return out;
}

}  // namespace palpate::runner::servo
