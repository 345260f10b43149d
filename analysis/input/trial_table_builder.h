#pragma once

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

/// Keeps each distinct name once and numbers them in order of first appearance.
class Interner {
 public:
  std::uint32_t number(std::string_view name);
  /// Whether the name is known already.
  bool holds(std::string_view name) const {
    return (!names_.empty() && names_[last_] == name) || numbers_.contains(name);
  }
  const std::deque<std::string>& names() const { return names_; }

 private:
  std::deque<std::string> names_;  // a deque: the views in numbers_ stay good
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
  std::uint32_t last_ = 0;
};

/// A time-out whose limit the source does not tell.
inline constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();

/// A row as a source has it.
struct RawTrial {
  std::string_view participant, renderer, shape, response;
  int session = 1, block = 1, trial = 1;
  bool correct = false, practice = false, timed_out = false, simulated = false;
  double response_time = 0;  ///< s; kNoTime only for a time-out
  std::size_t line = 0;      ///< of the file; 0: it has none
};

/// Turns rows into a TrialTable: leaves practice out, numbers names, orders levels, and warns of
/// what contradicts itself.
class TrialTableBuilder {
 public:
  void add(const RawTrial& raw);
  /// `listed`: the stimuli in the protocol's order, where it is known.
  /// \throws std::runtime_error where nothing but practice is there, or rows stand twice.
  TrialTable finish(Provenance provenance, const std::vector<std::string>& listed = {});

 private:
  struct Place {
    std::uint32_t participant;
    std::int32_t session, block, trial;
    std::uint32_t row;
    bool operator<(const Place& other) const {
      return std::tie(participant, session, block, trial, row) <
             std::tie(other.participant, other.session, other.block, other.trial, other.row);
    }
  };
  /// Sorts the places and numbers the rows by them.
  void number_places();
  void check_places(TrialTable& table);
  /// "lines 2 and 7, 3 and 8 and 4 more": of rows that share a place, the first and the next.
  std::string lines_of(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& rows) const;
  /// Time-outs without a time get the limit as far as the others tell it.
  void fill_times(TrialTable& table);

  Interner participants_, renderers_, stimuli_;
  /// By number of stimulus: 1 for the one shown first, 2, ...; 0: never shown, only answered.
  std::vector<std::uint32_t> shown_;
  std::uint32_t n_shown_ = 0;
  std::vector<TrialRow> rows_;
  std::vector<std::uint32_t> lines_;  ///< of each row, where the source has lines
  std::vector<Place> places_;
  std::size_t n_practice_ = 0, n_simulated_ = 0, n_contradicting_ = 0, n_late_answers_ = 0;
};

}  // namespace palpate::analysis
