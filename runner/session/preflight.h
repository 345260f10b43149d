#pragma once
// The checklist before the first trial: the device is homed; with force feedback also that forces
// have the right direction and keep to their limits, that the device moves as far as the stimuli
// need, and that its buttons work.

#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/participants/keyboard.h"
#include "runner/servo/sample.h"
#include "runner/session/device_check.h"
#include "runner/session/station.h"

namespace palpate::runner {

struct PreflightNeeds {
  double reach = 0;  ///< m, virtual frame: how far the tip must go to either side of the centre on
                     ///< each axis; 0: leave the range unchecked
  int buttons = 0;   ///< so many must work, from the first
  const ForceDirectionCheck* push = nullptr;  ///< to be felt; its limits are shown. None: unchecked
  double device_limit = 0;                    ///< N, the device's own, to be shown
};

/// Fed with the servo's samples, step by step. Shows no force itself.
class Preflight {
 public:
  enum class Step { homing, limits, range, buttons, done };

  explicit Preflight(const PreflightNeeds& needs) : needs_(needs) {}

  Step step() const { return step_; }
  void add(const Sample& sample);
  /// The experimenter goes on without the step; homing cannot be left out. Where the limits are
  /// checked: the push may come, or was felt.
  void skip();
  /// The push is to come once more.
  void repeat();
  /// Somebody is to push now, and to tell what became of it.
  bool push_due() const { return push_ == Push::due; }
  /// \param fault  what was wrong; empty: nothing
  void pushed(const std::string& fault);
  /// What there is to do, what of it is done, and what is due: what is missing and what the
  /// experimenter may say to it.
  Checklist checklist() const;
  /// For the record: what was checked and what was left out.
  const std::vector<std::string>& findings() const { return findings_; }

 private:
  void finish(const std::string& finding, bool left_out = false);
  bool asked_for(Step step) const;
  std::string instruction() const;
  void add_range(const Vec3& tip);
  std::string missing_sides() const;
  int missing_button() const;
  std::string limits_in_words() const;

  PreflightNeeds needs_;
  Step step_ = Step::homing;
  int homed_ = 0;                                ///< samples in a row
  DeviceTrouble trouble_ = DeviceTrouble::none;  ///< while it is lost
  enum class Push { not_yet, due, given } push_ = Push::not_yet;
  std::string push_fault_;  ///< of the last one
  Vec3 least_, most_;
  unsigned pressed_ = 0, released_ = 0;  ///< buttons seen down, and up
  std::vector<std::string> findings_;
  std::vector<Step> left_out_;
};

// The pre-flight of a live session at the console: the servo runs, the experimenter goes through
// the checklist, and no trial has begun.

struct PreflightResult {
  std::vector<std::string> findings;  ///< what was checked and what was left out, for the record
  std::vector<std::string> messages;  ///< that the console has shown
};

/// Until every step is done or left out and forces are allowed. For the session's own thread.
/// \param news  messages that the console shows first
/// \throws EndOfSession
PreflightResult run_preflight(const LiveStation& station, const std::vector<std::string>& news);

}  // namespace palpate::runner
