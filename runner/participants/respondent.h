#pragma once

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

/// Thrown where a trial is waited for: the attempt is cut off, what() says why.
class TrialCutOff : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Who answers: a person at a keyboard, or a model of one.
class Respondent {
 public:
  virtual ~Respondent() = default;
  /// A page of the protocol's texts; returns when the participant goes on. Empty: nothing to read.
  virtual void read(const std::string& text) = 0;
  /// A break: as read, but nobody goes on before `until_ns` (session clock).
  virtual void rest(const std::string& text, std::int64_t /*until_ns*/) { read(text); }
  /// Whether the last answer was right, where the protocol says so.
  virtual void feedback(bool correct) = 0;
  /// A trial is about to begin; the stylus is to go to the home zone.
  virtual void begin_trial(const protocols::Trial& trial) = 0;
  /// Called with what the servo did. The answer, once there is one; never one of before time zero.
  /// \throws TrialCutOff where the trial is to be shown again.
  virtual std::optional<Answer> step(const Sample& sample) = 0;
};

}  // namespace palpate::runner
