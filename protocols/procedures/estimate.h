#pragma once

#include <optional>

namespace palpate::protocols {

/// One answered trial.
struct Response {
  double level = 0;      ///< as it was shown
  bool success = false;  ///< correct (forced choice), or "yes"
};

/// What a procedure makes of the answers so far; a number that it does not estimate is missing.
struct Estimate {
  std::optional<double> threshold;           ///< a level
  std::optional<double> threshold_scale_sd;  ///< on the procedure's scale
  std::optional<double> slope, guess, lapse;
  int trials = 0;
  int reversals = 0;
  /// Trials at an end of the range (Staircase), series without a change (Limits): where there are
  /// many, the threshold lies outside.
  int at_limit = 0;
};

}  // namespace palpate::protocols
