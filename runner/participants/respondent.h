#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocols/schedule.h"
#include "runner/servo.h"

namespace palpate {

struct Answer {
  int stimulus = 0;          ///< index into Protocol::stimuli
  std::int64_t time_ns = 0;  ///< session clock, when the event arrived
};

/// Who answers: a person at a keyboard, or a model of one.
class Respondent {
 public:
  virtual ~Respondent() = default;
  /// A page of the protocol's texts; returns when the participant goes on. Empty: nothing to read.
  virtual void read(const std::string& text) = 0;
  /// Whether the last answer was right, where the protocol says so.
  virtual void feedback(bool correct) = 0;
  /// A trial is about to begin; the stylus is to go to the home zone.
  virtual void begin_trial(const Trial& trial) = 0;
  /// Called with what the servo did. The answer, once there is one.
  virtual std::optional<Answer> step(const Sample& sample) = 0;
};

}  // namespace palpate
