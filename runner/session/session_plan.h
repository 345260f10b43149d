#pragma once
// The schedule of one session as it is worked off.

#include <vector>

#include "protocols/schedule.h"

namespace palpate::runner {

/// The trials of one session in order, grown by further rounds of practice until the protocol's
/// criterion is met. Feeding it the answers on record brings it to where a session was interrupted.
class SessionPlan {
 public:
  SessionPlan(const protocols::Protocol& protocol, int participant_number, int session);

  bool finished() const { return next_ == trials_.size(); }
  const protocols::Trial& next() const { return trials_[next_]; }  ///< \pre not finished()
  std::size_t done() const { return next_; }
  std::size_t size() const { return trials_.size(); }  ///< as far as is known now
  /// The number of its last block.
  int blocks() const { return trials_.empty() ? 0 : trials_.back().block; }
  /// True at the first trial of a block (of a session, for the first).
  bool block_begins() const;
  /// The next trial has been answered.
  void answered(bool correct);

 private:
  void judge_practice();

  const protocols::Protocol* protocol_;
  int participant_number_;
  std::vector<protocols::Trial> trials_;
  std::size_t next_ = 0;
  int first_practice_block_ = 0;  ///< blocks before it are warm-up
  int round_ = 1;                 ///< of the practice under way
  int correct_ = 0, shown_ = 0;   ///< in that round
};

}  // namespace palpate::runner
