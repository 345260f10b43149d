#pragma once
// Descriptive statistics: counts, accuracy, confusion and response times. A cell is a renderer and
// a shape.
//
// Accuracy and confusion use all trials; a time-out counts as wrong and as no response. Times use
// trials with a correct answer and a response time of `too_fast` or more.

#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/input/trials.h"

namespace palpate::analysis {

/// Totals of the study.
struct Counts {
  std::size_t n_participants = 0, n_trials = 0, n_correct = 0, n_timeouts = 0;
  std::size_t n_too_fast = 0;  ///< answered before `too_fast`, correct or not
  std::size_t n_used_for_times = 0;
  std::optional<double> accuracy;  ///< n_correct / n_trials
};

/// Accuracies of a cell, as proportions.
struct AccuracyCell {
  std::size_t n_trials = 0, n_correct = 0, n_timeouts = 0, n_too_fast = 0;
  std::size_t n_correct_too_fast = 0;  ///< correct, but excluded from the times
  std::optional<double> accuracy;      ///< none: no trials
  std::optional<double>
      accuracy_answered;  ///< n_correct / (n_trials - n_timeouts); none: no answers
  std::optional<double> mean_of_participant_accuracies;
};

/// Response times of a cell in s; logs are natural logs of s. Means and standard deviations (n - 1;
/// none below two) over participants.
struct TimesCell {
  std::size_t n_participants = 0, n_trials = 0;
  std::optional<double> mean_of_participant_means, sd_of_participant_means;
  std::optional<double> mean_of_participant_medians, geomean_of_participant_geomeans;
  std::optional<double> mean_of_participant_mean_logs, sd_of_participant_mean_logs;
};

/// One participant's trials in a cell.
struct ParticipantCell {
  std::size_t n_trials = 0, n_correct = 0, n_used = 0;
  double mean = 0, median = 0;    ///< s; defined where n_used > 0
  double mean_log = 0;            ///< of natural logs of s; defined where n_used > 0
  double sum_of_squares_log = 0;  ///< sum of squared deviations of the logs from mean_log
};

/// [renderer][shape][participant]
using ParticipantCells = std::vector<std::vector<std::vector<ParticipantCell>>>;

/// All descriptive statistics.
struct Description {
  Counts counts;
  std::vector<std::vector<AccuracyCell>> accuracy;  ///< [renderer][shape]
  std::vector<std::vector<TimesCell>> times;        ///< [renderer][shape]
  /// [renderer][shape][answer]; the last one is "no response".
  std::vector<std::vector<std::vector<std::size_t>>> confusion;
  ParticipantCells participant_cells;
};

/// \param too_fast s, > 0: correct answers with a shorter time are excluded from the times
Description describe(const TrialTable& table, double too_fast);

/// Arithmetic mean. \param values not empty
double mean(const std::vector<double>& values);
/// Sample standard deviation (n - 1); none below two values.
std::optional<double> standard_deviation(const std::vector<double>& values);
/// Median; reorders the values. \param values not empty
double median(std::vector<double>& values);

}  // namespace palpate::analysis
