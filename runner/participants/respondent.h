#pragma once
// The interface between a session and its participant.

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/record.h"
#include "protocols/session_plan.h"
#include "runner/servo/servo.h"

namespace palpate::runner::participants {

struct Answer {
  int stimulus = 0;          ///< index into Protocol::stimuli; version 2: into TaskBlock::answers
  std::int64_t time_ns = 0;  ///< session clock, when the event arrived
  bool continues = false;    ///< no answer; continue with the next interval
  double number = 0;         ///< rate: the typed number
  int times = 1;             ///< adjust: number of turns at once
  /// external: as the program reports; none: correct if it names the stimulus.
  std::optional<bool> correct = std::nullopt;
};

/// The question in an interval of a trial of version 2.
struct IntervalView {
  int interval = 1, intervals = 1;  ///< number of the interval, from 1, and their count
  bool answers = true;              ///< an answer ends it; false: the participant continues
  bool felt = true;                 ///< false: after the last interval, forces off
  const protocols::Interval* shown = nullptr;  ///< null if nothing is felt
  bool continues = false;  ///< adjust, after a turn: forces go on, keys count at once
};

/// A screen to read.
struct ReadScreen {
  std::string text;
  std::shared_ptr<const std::string> picture{};  ///< bytes of a PNG file; may be null
};

/// How a question of a page is asked.
struct Asking {
  bool can_go_back = false;            ///< there is a question before it
  std::optional<std::string> given{};  ///< the answer in force, to be kept or changed
  bool number_follows = false;         ///< the next question wants a number
};

/// Short tones for the participant.
enum class SoundCue { ready, go, right, wrong };

/// Ends the current attempt of a trial; what() says why.
class TrialCutOff : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The session's interface to a participant: a person at a keyboard or a simulated one.
class Respondent {
 public:
  virtual ~Respondent() = default;
  /// Shows a text of the protocol; returns when the participant continues. Empty: returns at once.
  virtual void read(const std::string& text) = 0;
  /// Shows several screens, back and forth; returns when the participant continues after the last.
  virtual void read_screens(const std::vector<ReadScreen>& screens) {
    for (const ReadScreen& screen : screens) read(screen.text);
  }
  /// A break: like read, but lasts at least until `until_ns` (session clock).
  virtual void rest(const std::string& text, std::int64_t /*until_ns*/) { read(text); }
  /// Shows whether the last answer was correct, if the protocol asks for feedback.
  virtual void feedback(bool correct) = 0;
  /// The next trial is due. \return the trial's contents if a program chooses them (external
  /// blocks)
  virtual std::optional<protocols::TrialChoice> choose(const protocols::Trial& /*next*/) {
    return std::nullopt;
  }
  /// A trial is about to begin; the stylus must first be in the home zone.
  virtual void begin_trial(const protocols::Trial& trial) = 0;
  /// Version 2: an interval of that trial is about to begin.
  virtual void begin_interval(const protocols::Trial& /*trial*/, const IntervalView& /*view*/) {}
  /// Version 2: asks for the participant's confidence. \return step of the scale, and its time;
  /// none: no answer
  virtual std::optional<Answer> confidence(const protocols::ConfidenceSpec& /*asked*/) {
    return std::nullopt;
  }
  /// Version 2: asks a question of a page. \return the answer; "": skipped; none: back to the
  /// question before. Consent is "agree" or "disagree", a choice one of the item's `choices`.
  virtual std::optional<std::string> ask(const protocols::PageSpec& /*page*/,
                                         const protocols::PageItem& /*item*/,
                                         const Asking& /*how*/) {
    return "";
  }
  /// The frames drawn in the trial that ends; empty: nothing was seen.
  virtual std::vector<data::FrameRecord> frames() { return {}; }
  /// A trial is on record: of this run, or of an earlier one that the session resumes.
  virtual void learn_from(const data::TrialRecord& /*record*/) {}
  /// Called with every sample of the servo. Returns the answer once there is one; answers before
  /// time zero do not count. \throws TrialCutOff if the trial is to be repeated.
  virtual std::optional<Answer> step(const servo::Sample& sample) = 0;
};

}  // namespace palpate::runner::participants
