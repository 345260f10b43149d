#include "runner/session/preflight.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <utility>

#include "runner/session/live_forces.h"
#include "runner/session/session_end.h"

namespace palpate::runner::session {
namespace {

constexpr int kHomedLongEnough = 20;  // samples in a row
constexpr const char* kSides[] = {"left", "right", "down", "up", "away from you", "towards you"};

std::string millimetres(double metres) { return std::to_string(std::lround(metres * 1e3)) + " mm"; }

std::string newtons(double force) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f N", force);
  return text;
}

using Kind = display::ConsoleCommand::Kind;

// The missing items change while the stylus moves: keep an instruction long enough to be read.
constexpr std::int64_t kReading_ns = 1'000'000'000;

PreflightNeeds needs_of(const LiveStation& station) {
  PreflightNeeds needs;
  if (station.guard == nullptr) return needs;
  needs.reach = largest_reach(station);
  needs.push = station.direction_check;
  needs.device_limit = station.device.max_force;
  if (station.answer_by == participants::AnswerBy::buttons)
    needs.buttons = static_cast<int>(station.protocol.response.keys.size());
  return needs;
}

class PreflightDialogue {
 public:
  PreflightDialogue(const LiveStation& station, const std::vector<std::string>& news)
      : station_(station),
        preflight_(needs_of(station)),
        shown_ns_(station.clock.now_ns() - kReading_ns / 2) {  // waits half a second for news
    state_.study = station.protocol.name;
    state_.participant = station.record.participant().code;
    state_.session = station.record.session();
    state_.state = "pre-flight";
    state_.messages = news;
  }

  PreflightResult run() {
    while (preflight_.step() != Preflight::Step::done || !state_.fault.empty()) {
      station_.clock.wait_until(station_.clock.now_ns() + kSessionNap_ns);
      if (station_.servo_thread.latest(state_.sample)) preflight_.add(state_.sample);
      station_.screen.keys();  // discard earlier keys
      take_commands();
      end_if_due();
      if (preflight_.push_due() && state_.fault.empty()) check_force_direction();
      show();
    }
    station_.servo_thread.clear_fault();  // without readings before homing
    station_.console.show(state_);
    std::vector<std::string> findings = preflight_.findings();
    findings.insert(findings.end(), emergencies_.begin(), emergencies_.end());
    return {findings, state_.messages};
  }

 private:
  void take_commands() {
    std::vector<display::ConsoleCommand> commands = std::exchange(while_pushed_, {});
    for (display::ConsoleCommand& more : station_.console.commands())
      commands.push_back(std::move(more));
    for (const display::ConsoleCommand& command : commands) {
      obey(command);
      if (!state_.fault.empty()) continue;
      // A key pressed during the push does not confirm that it was felt.
      if (command.kind == Kind::resume && command.time_ns >= pushed_ns_) preflight_.skip();
      if (command.kind == Kind::repeat_trial) preflight_.repeat();
    }
  }

  /// Obeys commands that are valid at any step. \throws EndOfSession
  void obey(const display::ConsoleCommand& command) {
    switch (command.kind) {
      case Kind::quit:
        throw end_by_experimenter(command.text);
      case Kind::emergency_zero:
        state_.fault = "zero force was asked for by " + command.text;
        emergencies_.push_back("EMERGENCY by " + command.text);
        say(emergencies_.back() + ": forces are off until the fault is cleared");
        break;
      case Kind::note:
        take_note(command);
        break;
      case Kind::pause:
      case Kind::answer:
      case Kind::correct:
      case Kind::stop_after_trial:
      case Kind::stop_after_block:
        say("there is no trial yet");
        break;
      case Kind::clear_fault:
        clear_fault();
        break;
      case Kind::resume:
      case Kind::repeat_trial:
        break;
    }
  }

  void take_note(const display::ConsoleCommand& note) {
    try {
      station_.record.write_down(note.time_ns, note.text);
      say("note: " + note.text);
    } catch (const data::StoreRefused& refused) {  // empty, or invalid UTF-8
      say(refused.what());
    }
  }

  void clear_fault() {
    LiveForces forces(station_.servo_thread, station_.guard, station_.clock);
    const std::string trouble = forces.allow([this] { return station_.end_requested() != 0; });
    if (trouble.empty()) state_.fault.clear();
    say(trouble.empty() ? "the device works" : "not cleared: " + trouble);
  }

  /// Called also while waiting for the push or for homing. \throws EndOfSession
  void end_if_due() const {
    const servo::DeviceTrouble trouble = state_.sample.trouble;
    if (station_.end_requested() != 0)
      throw EndOfSession(data::RunEnd::aborted, "a signal asked for the end", true);
    if (!station_.screen.open())
      throw EndOfSession(data::RunEnd::aborted, "the participant's screen was closed", true);
    if (trouble == servo::DeviceTrouble::guard_lost)
      throw EndOfSession(data::RunEnd::aborted, servo::advice(trouble), true);
  }

  void check_force_direction() {
    station_.servo_thread.clear_fault();  // without readings before homing
    preflight_.pushed(station_.direction_check->push(station_.servo_thread, [this] {
      bool quit = station_.end_requested() != 0;
      for (display::ConsoleCommand& more : station_.console.commands()) {
        quit = quit || more.kind == Kind::quit;
        while_pushed_.push_back(std::move(more));
      }
      return quit;
    }));
    pushed_ns_ = station_.clock.now_ns();
  }

  display::Checklist checklist() const {
    display::Checklist list = preflight_.checklist();
    const servo::DeviceTrouble trouble = state_.sample.trouble;
    // Trouble that the hand at the grip cannot fix.
    if (servo::needs_reopening(trouble))
      list.instruction += "; after that " + station_.console.name_of(Kind::clear_fault);
    if (!state_.fault.empty()) {  // no other command is obeyed first
      list.instruction = "forces are off: " + state_.fault +
                         "; next: " + station_.console.name_of(Kind::clear_fault);
      list.choices.clear();
    }
    return list;
  }

  void show() {
    display::Checklist list = checklist();
    const std::int64_t now = station_.clock.now_ns();
    if (list.instruction != shown_ && now - shown_ns_ > kReading_ns) {
      shown_ = list.instruction;
      shown_ns_ = now;
      display::Page page;
      page.kind = display::Page::Kind::checklist;
      page.checklist = list;
      station_.screen.show(page);
      state_.checklist = std::move(list);
    }
    station_.console.show(state_);
  }

  void say(const std::string& message) { state_.messages.push_back(message); }

  const LiveStation& station_;
  Preflight preflight_;
  display::ConsoleState state_;
  std::string shown_;           ///< the instruction on show
  std::int64_t shown_ns_;       ///< shown since then; session clock
  std::int64_t pushed_ns_ = 0;  ///< when the last push ended; session clock
  std::vector<display::ConsoleCommand>
      while_pushed_;  ///< commands that came during a push: not obeyed yet
  std::vector<std::string> emergencies_;
};

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

void Preflight::add(const servo::Sample& sample) {
  // If forces were turned off on request or by the guard, the device stays homed.
  if (sample.trouble == servo::DeviceTrouble::guarded && step_ != Step::homing) return;
  const bool lost = (sample.faults & servo::servo_fault::kDeviceLost) != 0;
  trouble_ = sample.trouble;
  if (lost) {  // also later: a lost device must be homed again
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
      pressed_ |= sample.buttons & released_;  // a stuck button does not count
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
  const servo::ForceLimits& limits = needs_.push->limits();
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
      if (trouble_ != servo::DeviceTrouble::none && trouble_ != servo::DeviceTrouble::not_homed &&
          trouble_ != servo::DeviceTrouble::guarded)
        return servo::advice(trouble_);
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

display::Checklist Preflight::checklist() const {
  using State = display::Checklist::Step::State;
  using Kind = display::ConsoleCommand::Kind;
  display::Checklist list;
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
    list.choices = {{Kind::resume, "yes"}, {Kind::repeat_trial, "once more"}, {Kind::quit, "no"}};
  } else if (step_ == Step::limits) {
    list.choices = {{Kind::resume, "push"}};
  } else if (step_ == Step::range || step_ == Step::buttons) {
    list.choices = {{Kind::resume, "leave it unchecked"}};
  }
  return list;
}

PreflightResult run_preflight(const LiveStation& station, const std::vector<std::string>& news) {
  return PreflightDialogue(station, news).run();
}

}  // namespace palpate::runner::session
