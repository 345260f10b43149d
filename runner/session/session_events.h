#pragma once
// The events of a session, for the experimenter's console and for markers.

#include <cstdint>
#include <string>

#include "data/record.h"
#include "protocols/schedule.h"
#include "runner/participants/respondent.h"

namespace palpate::runner::session {

/// The visible part of a page.
struct PageView {
  std::string page, question;  ///< names; for a consent the question is "consent"
  int number = 0, questions = 0;
};

/// The events of a trial, as they happen: for markers and the experimenter's console.
class SessionEvents {
 public:
  virtual ~SessionEvents() = default;
  virtual void began(const protocols::Trial& trial) = 0;
  /// Time zero.
  virtual void onset(const data::TrialRecord& so_far) = 0;
  /// \param time_ns  session clock
  virtual void first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) = 0;
  virtual void answered(
      const data::TrialRecord& record) = 0;  ///< not on record yet; also a time-out
  virtual void cut_off(const std::string& reason) = 0;
  virtual void recorded(const data::TrialRecord& record) = 0;
  /// An interval of the trial, which belongs to a block, is about to begin.
  virtual void interval(const protocols::Trial& /*trial*/,
                        const participants::IntervalView& /*view*/) {}
  /// A page is shown, or one of its questions: its number, from 1, and their count; 0:
  /// the text. Empty names: the page is over.
  virtual void page(const PageView& /*view*/) {}
  /// The trial is answered, and confidence will be asked. A kill would lose the answer otherwise.
  virtual void unrated(const data::TrialRecord& /*so_far*/) {}
  /// The question for confidence begins (forces off) or ends.
  virtual void asking(bool /*now*/) {}
};

}  // namespace palpate::runner::session
