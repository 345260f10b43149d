#pragma once
// Before the first trial, with a device that can push: is it homed, does it move as far as the
// stimuli need, do its buttons work.

#include <string>
#include <vector>

#include "runner/participants/keyboard.h"
#include "runner/sample.h"

namespace palpate {

struct PreflightNeeds {
  double reach = 0;  ///< m, virtual frame: how far the tip must go to either side of the centre on
                     ///< each axis; 0: leave the range unchecked
  int buttons = 0;   ///< so many must work, from the first
};

/// Fed with the servo's samples, step by step. Shows no force.
class Preflight {
 public:
  enum class Step { homing, range, buttons, done };

  explicit Preflight(const PreflightNeeds& needs) : needs_(needs) {}

  Step step() const { return step_; }
  void add(const Sample& sample);
  /// The experimenter goes on without the step; homing cannot be left out.
  void skip();
  /// What the experimenter is asked to do, and what is missing.
  std::string instruction() const;
  /// For the record: what was checked and what was left out.
  const std::vector<std::string>& findings() const { return findings_; }

 private:
  void finish(const std::string& finding);
  void add_range(const Vec3& tip);
  std::string missing_sides() const;
  int missing_button() const;

  PreflightNeeds needs_;
  Step step_ = Step::homing;
  int homed_ = 0;  ///< samples in a row
  Vec3 least_, most_;
  unsigned pressed_ = 0, released_ = 0;  ///< buttons seen down, and up
  std::vector<std::string> findings_;
};

}  // namespace palpate
