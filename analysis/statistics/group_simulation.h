#pragma once
// Simulated studies of psychometric functions with two renderers, analysed by the group's model:
// how often its intervals hold the truth, and how often it finds a difference.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/group_answers.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::analysis {

/// Location and log width are normal over participants, and so are their differences between
/// renderers (second minus first), on the scales of GroupFit.
struct GroupStudy {
  std::string name;
  GroupPsychometricModel model;
  std::vector<protocols::ProcedureSpec> tracks;  ///< of a participant with a renderer
  int catch_trials = 0;                          ///< own_guess: in addition
  std::size_t participants = 6;
  double location = 0, location_sd = 0, location_difference = 0, location_difference_sd = 0;
  double log_width = 0, log_width_sd = 0.3, log_ratio = 0, log_ratio_sd = 0.15;
  double lapse = 0.02;         ///< at either end if both_lapse
  bool lapses_differ = false;  ///< exponential over participants, with `lapse` as mean
  double guess = 0;            ///< own_guess: of each participant
};

/// The conditions in which the method was chosen: few and many participants and trials, lapses,
/// adaptive procedures, forced choice, yes/no, steep functions. No difference between renderers.
std::vector<GroupStudy> group_coverage_studies();
/// Forced choice of three, one staircase of 42 trials, lapses of 5 %, no difference: the hardest
/// case for the level of the test.
GroupStudy hardest_group_study();

/// Answers [renderer][participant] of a study.
std::vector<std::vector<GroupAnswers>> simulated_answers(const GroupStudy& study,
                                                         std::uint64_t seed, std::size_t number);

/// Sums over studies of an estimate.
struct GroupTally {
  std::size_t results = 0;    ///< studies with an estimate
  std::size_t held = 0;       ///< its 95 % interval holds the truth; an open end holds all beyond
  std::size_t open = 0;       ///< an end of the interval is open
  std::size_t both_open = 0;  ///< both: not determined
  std::size_t found = 0;      ///< differences: p below alpha
  double error = 0;           ///< sum of (estimate - truth)

  double bias() const { return results == 0 ? 0 : error / static_cast<double>(results); }
};

struct GroupCoverage {
  GroupStudy study;
  std::size_t studies = 0;
  GroupTally location, log_width;                        ///< of both renderers, with their truths
  GroupTally location_difference, log_width_difference;  ///< second minus first
};

struct GroupCoverageSettings {
  std::size_t studies = 200;
  std::uint64_t seed = 1;
  std::size_t jobs = 1;
  double alpha = 0.05;
  bool means = true;                     ///< false: differences alone
  bool intervals = true;                 ///< of differences
  std::function<void(double)> progress;  ///< called with the share done; may be empty
};

/// The result does not depend on the number of jobs. The model is on a coarse grid.
std::vector<GroupCoverage> group_coverage(const std::vector<GroupStudy>& studies,
                                          const GroupCoverageSettings& settings);

}  // namespace palpate::analysis
