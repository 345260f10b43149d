#pragma once
// Counts, accuracy, confusion and response times. Cells are a renderer and a shape.
//
// Accuracy and confusion use every row; a time-out counts as wrong and as no response, an answer
// before `too_fast` as answered. Times use rows that are correct, answered, and took `too_fast` or
// longer.

#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/input/trials.h"

namespace palpate::analysis {

struct Counts {
  std::size_t n_participants = 0, n_trials = 0, n_correct = 0, n_timeouts = 0;
  std::size_t n_too_fast = 0;  ///< answered before `too_fast`, right or wrong
  std::size_t n_used_for_times = 0;
  std::optional<double> accuracy;
};

struct AccuracyCell {
  std::size_t n_trials = 0, n_correct = 0, n_timeouts = 0, n_too_fast = 0;
  std::size_t n_correct_too_fast = 0;       ///< these alone are lost to the times
  std::optional<double> accuracy;           ///< none: no trials
  std::optional<double> accuracy_answered;  ///< time-outs left out; none: nothing left
  std::optional<double> mean_of_participant_accuracies;
};

/// Seconds, logs are natural logs of seconds. sd with n - 1, none below two participants.
struct TimesCell {
  std::size_t n_participants = 0, n_trials = 0;
  std::optional<double> mean_of_participant_means, sd_of_participant_means;
  std::optional<double> mean_of_participant_medians, geomean_of_participant_geomeans;
  std::optional<double> mean_of_participant_mean_logs, sd_of_participant_mean_logs;
};

/// One participant's part of a cell.
struct ParticipantCell {
  std::size_t n_trials = 0, n_correct = 0, n_used = 0;
  double mean = 0, median = 0;  ///< s; good where n_used > 0
  double mean_log = 0;          ///< of natural logs of s; good where n_used > 0
  double squares_log = 0;       ///< sum of squared deviations of the logs from mean_log
};

/// [renderer][shape][participant]
using People = std::vector<std::vector<std::vector<ParticipantCell>>>;

struct Description {
  Counts counts;
  std::vector<std::vector<AccuracyCell>> accuracy;  ///< [renderer][shape]
  std::vector<std::vector<TimesCell>> times;        ///< [renderer][shape]
  /// [renderer][shape][answer]; the last one is "no response".
  std::vector<std::vector<std::vector<std::size_t>>> confusion;
  People people;
};

/// \param too_fast s, > 0: correct answers before it are left out of the times; exactly it is kept
Description describe(const TrialTable& table, double too_fast);

/// Mean of values that are not empty.
double mean(const std::vector<double>& values);
/// Standard deviation with n - 1; none below two values.
std::optional<double> standard_deviation(const std::vector<double>& values);
/// The middle, of an even count the mean of the middle two; reorders. \param values not empty
double median(std::vector<double>& values);

}  // namespace palpate::analysis
