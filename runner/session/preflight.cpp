#include "runner/session/preflight.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace palpate::runner {
namespace {

constexpr int kHomedLongEnough = 20;  // samples in a row
constexpr const char* kSides[] = {"left", "right", "down", "up", "away from you", "towards you"};

std::string millimetres(double metres) { return std::to_string(std::lround(metres * 1e3)) + " mm"; }

std::string newtons(double force) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f N", force);
  return text;
}

}  // namespace

bool Preflight::asked_for(Step step) const {
  switch (step) {
    case Step::homing:
      return true;
    case Step::limits:
      return needs_.push != nullptr;
    case Step::range:
      return needs_.reach > 0;
    case Step::buttons:
      return needs_.buttons > 0;
    case Step::done:
      break;
  }
  return false;
}

void Preflight::finish(const std::string& finding, bool left_out) {
  findings_.push_back(finding);
  if (left_out) left_out_.push_back(step_);
  do {
    step_ = static_cast<Step>(static_cast<int>(step_) + 1);
  } while (step_ != Step::done && !asked_for(step_));
}

void Preflight::add(const Sample& sample) {
  // Forces that were asked off, or that the guard took off, leave the device where it is.
  if (sample.trouble == DeviceTrouble::guarded && step_ != Step::homing) return;
  const bool lost = (sample.faults & servo_fault::kDeviceLost) != 0;
  trouble_ = sample.trouble;
  if (lost) {  // also later: a device that was lost has to be homed again
    homed_ = 0;
    if (step_ == Step::done) return;
    step_ = Step::homing;
    if (push_ != Push::not_yet) push_fault_ = "the device was lost";
    push_ = Push::not_yet;
    return;
  }
  switch (step_) {
    case Step::homing:
      least_ = most_ = sample.probe.tip;
      if (++homed_ >= kHomedLongEnough) finish("device homed");
      break;
    case Step::limits:
      break;
    case Step::range:
      add_range(sample.probe.tip);
      break;
    case Step::buttons:
      pressed_ |= sample.buttons & released_;  // one that is stuck does not count
      released_ |= ~static_cast<unsigned>(sample.buttons);
      if (missing_button() == 0) finish("buttons 1 to " + std::to_string(needs_.buttons) + " work");
      break;
    case Step::done:
      break;
  }
}

void Preflight::add_range(const Vec3& tip) {
  for (int i = 0; i < 3; ++i) {
    least_[i] = std::min(least_[i], tip[i]);
    most_[i] = std::max(most_[i], tip[i]);
  }
  if (missing_sides().empty()) finish("range of " + millimetres(needs_.reach) + " to each side");
}

std::string Preflight::missing_sides() const {
  std::string missing;
  for (int i = 0; i < 6; ++i) {
    const double went = i % 2 == 0 ? -least_[i / 2] : most_[i / 2];
    if (went >= needs_.reach) continue;
    if (!missing.empty()) missing += ", ";
    missing += kSides[i];
  }
  return missing;
}

int Preflight::missing_button() const {
  for (int i = 0; i < needs_.buttons; ++i) {
    if ((pressed_ >> i & 1U) == 0) return i + 1;
  }
  return 0;
}

std::string Preflight::limits_in_words() const {
  const ForceLimits& limits = needs_.push->limits();
  return "forces of up to " + newtons(limits.max_force) +
         (needs_.push->both_ends() ? " at each end" : " at the grip") +
         " (the device's own limit: " + newtons(needs_.device_limit) + "), " +
         newtons(limits.max_change) + " of change a tick";
}

void Preflight::repeat() {
  if (step_ == Step::limits) push_ = Push::due;
}

void Preflight::pushed(const std::string& fault) {
  push_fault_ = fault;
  push_ = fault.empty() ? Push::given : Push::not_yet;
}

void Preflight::skip() {
  if (step_ == Step::limits) {
    if (push_ == Push::given) {
      finish("a push of " + newtons(needs_.push->force()) +
             " to the right was felt; limits: " + limits_in_words());
    } else {
      push_ = Push::due;
    }
    return;
  }
  if (step_ == Step::range) finish("range NOT checked: not reached: " + missing_sides(), true);
  if (step_ == Step::buttons)
    finish("button " + std::to_string(missing_button()) + " and those after it NOT checked", true);
}

std::string Preflight::instruction() const {
  switch (step_) {
    case Step::homing:
      if (trouble_ != DeviceTrouble::none && trouble_ != DeviceTrouble::not_homed &&
          trouble_ != DeviceTrouble::guarded)
        return advice(trouble_);
      return "home the device: pull the grip fully out, then push it straight in";
    case Step::limits:
      if (push_ == Push::given) return "was a weak push to the right felt?";
      return (push_fault_.empty() ? "limits: " + limits_in_words()
                                  : "the force direction check failed: " + push_fault_) +
             "; hold the grip: a push of " + newtons(needs_.push->force()) +
             " to the right comes for a second";
    case Step::range:
      return "move the stylus " + millimetres(needs_.reach) +
             " from the centre; still to come: " + missing_sides();
    case Step::buttons:
      return "press button " + std::to_string(missing_button()) + " of the device";
    case Step::done:
      break;
  }
  return "";
}

Checklist Preflight::checklist() const {
  using State = Checklist::Step::State;
  using Kind = ConsoleCommand::Kind;
  Checklist list;
  for (const auto& [step, words] : {std::pair(Step::homing, "Home the device"),
                                    std::pair(Step::limits, "Feel a weak push to the right"),
                                    std::pair(Step::range, "Move to every side"),
                                    std::pair(Step::buttons, "Press the buttons")}) {
    if (!asked_for(step)) continue;
    const bool left_out = std::count(left_out_.begin(), left_out_.end(), step) > 0;
    list.steps.push_back({words, step_ == step  ? State::now
                                 : step_ < step ? State::to_do
                                 : left_out     ? State::left_out
                                                : State::done});
  }
  list.instruction = instruction();
  if (step_ == Step::limits && push_ == Push::given) {
    list.choices = {{Kind::go_on, "yes"}, {Kind::repeat_trial, "once more"}, {Kind::quit, "no"}};
  } else if (step_ == Step::limits) {
    list.choices = {{Kind::go_on, "push"}};
  } else if (step_ == Step::range || step_ == Step::buttons) {
    list.choices = {{Kind::go_on, "leave it unchecked"}};
  }
  return list;
}

}  // namespace palpate::runner
