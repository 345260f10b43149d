#pragma once
// The checklist before the first trial: the device is homed; with force feedback also the force
// direction and limits, the range of movement that the stimuli need, and the buttons.

#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/participants/keyboard.h"
#include "runner/servo/sample.h"
#include "runner/session/device_check.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

struct PreflightNeeds {
  double reach = 0;  ///< m, virtual frame: how far the tip must move to either side of the centre
                     ///< on each axis; 0: leave the range unchecked
  int buttons = 0;   ///< number of buttons that must work, from the first
  const ForceDirectionCheck* push = nullptr;  ///< to be felt; its limits are shown. None: unchecked
  double device_limit = 0;                    ///< N, the device's own, for display
};

/// The steps of the checklist, advanced by the servo's samples. Commands no force itself.
class Preflight {
 public:
  enum class Step { homing, limits, range, buttons, done };

  explicit Preflight(const PreflightNeeds& needs) : needs_(needs) {}

  Step step() const { return step_; }
  void add(const servo::Sample& sample);
  /// The experimenter continues without the step; homing cannot be skipped. At the step of the
  /// limits: begins the push, or confirms that it was felt.
  void skip();
  /// Asks for the push once more.
  void repeat();
  /// Whether the push is due; the caller pushes and reports the result to pushed().
  bool push_due() const { return push_ == Push::due; }
  /// \param fault  of the push; empty: none
  void pushed(const std::string& fault);
  /// The steps, the finished ones, the current one with its missing items and the experimenter's
  /// options.
  display::Checklist checklist() const;
  /// For the record: the checks done and skipped.
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
  int homed_ = 0;                                              ///< samples in a row
  servo::DeviceTrouble trouble_ = servo::DeviceTrouble::none;  ///< while the device is lost
  enum class Push { not_yet, due, given } push_ = Push::not_yet;
  std::string push_fault_;  ///< of the last push
  Vec3 least_, most_;
  unsigned pressed_ = 0, released_ = 0;  ///< buttons seen down, and up
  std::vector<std::string> findings_;
  std::vector<Step> left_out_;
};

struct PreflightResult {
  std::vector<std::string> findings;  ///< the checks done and skipped, for the record
  std::vector<std::string> messages;  ///< shown on the console
};

/// Runs the pre-flight of a live session at the console: the servo runs, the experimenter works
/// through the checklist, and no trial has begun. Returns when every step is done or skipped and
/// forces are allowed. For the session's own thread.
/// \param news  messages that the console shows first
/// \throws EndOfSession
PreflightResult run_preflight(const LiveStation& station, const std::vector<std::string>& news);

}  // namespace palpate::runner::session
