#pragma once
// Coverage of the 95 % intervals of fitted psychometric functions, for levels chosen in advance or
// by the answers, with and without lapses.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::analysis {

/// A study of one simulated participant, and the model of its fit.
struct CoverageDesign {
  std::string task, procedure;  ///< in words
  std::vector<protocols::ProcedureSpec> tracks;
  int catch_trials = 0;  ///< in addition to those of the tracks: without a stimulus
  protocols::PsychometricParticipant truth;
  PsychometricModel model;
};

/// Two intervals with levels on both sides of the standard, forced choice, and yes/no with catch
/// trials, each with constant stimuli, staircases, QUEST+ and (yes/no) limits, at each lapse rate.
/// The models are those of `analyze`.
std::vector<CoverageDesign> coverage_designs(const std::vector<double>& lapses);

/// Number of studies with the true value in an interval.
struct CoverageCounts {
  std::size_t threshold = 0, slope = 0, lapse = 0;
};

struct CoverageResult {
  CoverageDesign design;
  std::size_t studies = 0;    ///< with a fit; others have no interval
  std::size_t unfitted = 0;   ///< all answers alike, or one level
  std::size_t open = 0;       ///< the interval of the threshold is unbounded on one side
  CoverageCounts likelihood;  ///< by profile likelihood
  CoverageCounts bayes;
  std::size_t bayes_studies = 0;  ///< with a posterior; with two free rates, one study in four
  /// Fits whose goodness of fit has p <= 0.05; five in a hundred if the model is correct.
  std::size_t called_bad = 0;
  double mean_trials = 0;
  double slope_bias = 0;  ///< median of fitted slope / true slope, minus 1
};

/// Wilson's 95 % interval of a share of studies.
Interval coverage_interval(std::size_t held, std::size_t studies);

struct CoverageSettings {
  std::vector<double> lapses{0, 0.02, 0.05};
  std::size_t studies = 500;  ///< of each design
  std::uint64_t seed = 1;
  std::size_t jobs = 1;
  int simulations = 39;                  ///< per goodness of fit: 2 of 40 ranks are 5 %
  std::function<void(double)> progress;  ///< called with the share done; may be empty
};

/// The result does not depend on the number of jobs.
std::vector<CoverageResult> interval_coverage(const CoverageSettings& settings);

}  // namespace palpate::analysis
