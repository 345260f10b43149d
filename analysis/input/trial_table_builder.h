#pragma once
// Builds a TrialTable from the rows of any source.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "analysis/input/trials.h"

namespace palpate::analysis {

/// Numbers distinct names, from 0, in order of first appearance (string interning).
class Interner {
 public:
  std::uint32_t number(std::string_view name);
  /// Whether the name has a number.
  bool contains(std::string_view name) const {
    return (!names_.empty() && names_[last_] == name) || numbers_.contains(name);
  }
  const std::deque<std::string>& names() const { return names_; }

 private:
  std::deque<std::string> names_;  // a deque: the views in numbers_ stay valid
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
  std::uint32_t last_ = 0;
};

/// Response time of a time-out whose limit the source does not give.
inline constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();

/// A row of a source, practice included; see data/README.md for the columns.
struct RawTrial {
  std::string_view participant, renderer, shape, response;
  int session = 1, block = 1, trial = 1;
  bool correct = false, practice = false, timed_out = false, simulated = false;
  double response_time = 0;  ///< s; kNoTime only for a time-out
  std::size_t line = 0;      ///< line number in the file, from 1; 0: none
};

/// Turns rows into a TrialTable: drops practice, numbers and orders the levels of renderer and
/// shape, and warns of contradictions.
class TrialTableBuilder {
 public:
  void add(const RawTrial& raw);
  /// \param listed the stimuli in the protocol's order; empty: unknown
  /// \throws std::runtime_error without any trial that is not practice, or if a row is repeated
  /// exactly
  TrialTable finish(Provenance provenance, const std::vector<std::string>& listed = {});

 private:
  /// What identifies a trial, and its index in rows_.
  struct TrialKey {
    std::uint32_t participant;
    std::int32_t session, block, trial;
    std::uint32_t row;
    bool operator<(const TrialKey& other) const {
      return std::tie(participant, session, block, trial, row) <
             std::tie(other.participant, other.session, other.block, other.trial, other.row);
    }
  };
  /// Sorts keys_ and sets TrialRow::position and exposure.
  void number_trials();
  void check_repeated_trials(TrialTable& table);
  /// " (lines 2 and 7, 3 and 8, and 4 more)": pairs of rows with the same key.
  std::string lines_of(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& rows) const;
  /// Replaces kNoTime by the largest known limit, else by the longest time of all trials.
  void fill_times(TrialTable& table);

  Interner participants_, renderers_, stimuli_;
  /// By number of the stimulus: order of first presentation from 1; 0: only answered, never shown.
  std::vector<std::uint32_t> shown_;
  std::uint32_t n_shown_ = 0;
  std::vector<TrialRow> rows_;
  std::vector<std::uint32_t> lines_;  ///< of each row, where the source has lines
  std::vector<TrialKey> keys_;
  std::size_t n_practice_ = 0, n_simulated_ = 0, n_contradicting_ = 0, n_late_answers_ = 0;
};

}  // namespace palpate::analysis
