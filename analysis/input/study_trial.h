#pragma once
// One trial of a study as every reader gives it and every analysis takes it.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/record.h"
#include "stimuli/vec.h"

namespace palpate::analysis {

/// A trial that was completed.
struct StudyTrial {
  std::string participant, task = "identify", block_name, renderer, shape, response;
  std::string track;
  std::string group;  ///< of the participant; "": none, or unknown
  std::optional<double> level, standard_level, number, confidence;
  /// Of a level of several dimensions, in the protocol's order: name and value. Empty: none.
  std::vector<std::pair<std::string, double>> dimensions = {};
  bool catch_trial = false, success = false, answered = false;
  std::optional<bool> correct;  ///< none: no answer is right or wrong
  int participant_number = 0;   ///< orders the trials; 0: unknown
  int session = 1, block = 1, trial = 1;
  bool practice = false;  ///< left out of tables
  bool timed_out = false, simulated = false;
  int intervals = 0;                       ///< compare: number of intervals; 0: unknown
  std::string protocol_sha256;             ///< "": unknown
  std::optional<double> response_time;     ///< s; none: not in the source
  std::optional<data::ReachRecord> reach;  ///< reach: its measures
  std::vector<Vec3> path;                  ///< reach: m, of the tip, for figures; empty: unknown
  std::size_t line = 0;                    ///< of the file, from 1; 0: none
};

/// Converts a stored completed trial.
StudyTrial study_trial_of(const std::string& participant, const data::TrialRecord& record);

}  // namespace palpate::analysis
