#pragma once

#include <optional>
#include <vector>

#include "protocols/procedures/estimate.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

/// Goes on from the level that was shown, also where it is not the one that was asked for.
class StaircaseRun {
 public:
  explicit StaircaseRun(Staircase spec);

  std::optional<double> next_level() const;
  void record(const Response& response);
  /// Threshold: mean on the scale of an even number of reversals after the discarded ones; of an
  /// odd number the first is left out, too, so that peaks and valleys balance (Levitt 1971).
  Estimate estimate() const;
  /// Levels at which the track turned.
  std::vector<double> reversal_levels() const;

 private:
  void move(bool harder);

  Staircase spec_;
  double position_, low_, high_;  // on the scale
  int successes_ = 0, failures_ = 0;
  int direction_ = 0;  // of the last move: 1 harder, -1 easier
  std::vector<double> reversals_;
  int trials_ = 0, at_limit_ = 0;
};

}  // namespace palpate::protocols
