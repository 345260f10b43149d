#pragma once
// The interface between a session and its participant.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "protocols/schedule.h"
#include "runner/servo/servo.h"

namespace palpate::runner {

struct Answer {
  int stimulus = 0;          ///< index into Protocol::stimuli
  std::int64_t time_ns = 0;  ///< session clock, when the event arrived
};

/// Ends the current attempt of a trial; what() says why.
class TrialCutOff : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A participant as the session sees one: a person at a keyboard or a simulated participant.
class Respondent {
 public:
  virtual ~Respondent() = default;
  /// Shows a text of the protocol; returns when the participant goes on. Empty: returns at once.
  virtual void read(const std::string& text) = 0;
  /// A break: like read, but at least until `until_ns` (session clock).
  virtual void rest(const std::string& text, std::int64_t /*until_ns*/) { read(text); }
  /// Shows whether the last answer was correct, if the protocol asks for feedback.
  virtual void feedback(bool correct) = 0;
  /// A trial is about to begin; the stylus must first be in the home zone.
  virtual void begin_trial(const protocols::Trial& trial) = 0;
  /// Called with every sample of the servo. Returns the answer once there is one, never one from
  /// before time zero. \throws TrialCutOff if the trial is to be repeated.
  virtual std::optional<Answer> step(const Sample& sample) = 0;
};

}  // namespace palpate::runner
