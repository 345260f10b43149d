#include "runner/display/console_words.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "data/base/utf8.h"
#include "runner/safety/fault_signals.h"

namespace palpate::runner::display {
namespace {

/// The reason why forces are off, if session or servo gave one.
std::string forces_off_reason(const ConsoleState& state) {
  if (!state.fault.empty()) return state.fault;
  const std::string words =
      safety::fault_words(state.sample.faults & ~servo::servo_fault::kTripped);
  return words.empty() ? safety::fault_row(servo::servo_fault::kTripped).why : words;
}

}  // namespace

const char* button_label(ConsoleCommand::Kind kind) {
  using Kind = ConsoleCommand::Kind;
  switch (kind) {
    case Kind::pause:
      return "Pause";
    case Kind::resume:
      return "Go on";
    case Kind::repeat_trial:
      return "Repeat trial";
    case Kind::stop_after_trial:
      return "Stop after trial";
    case Kind::stop_after_block:
      return "Stop after block";
    case Kind::emergency_zero:
      return "EMERGENCY: ZERO FORCE";
    case Kind::clear_fault:
      return "Clear the fault";
    case Kind::note:
      return "Enter";
    case Kind::quit:
      return "End now...";
    case Kind::answer:
      return "Enter";
    case Kind::correct:
      return "Correct an answer...";
  }
  return "";
}

std::string state_title(const ConsoleState& state) {
  if (state.state.empty()) return "waiting";
  if (state.seconds_left > 0 || state.state == "rest") return "break";
  return state.state.substr(0, state.state.find(": "));
}

std::string state_detail(const ConsoleState& state) {
  if (!state.stop_plan.empty()) return "stops " + state.stop_plan;
  if (state.pauses) return "pauses after this trial";
  if (!state.held_by.empty()) return {};
  if (state.seconds_left > 0) return duration_text(state.seconds_left) + " left";
  // "question 2 of 5: PAGE, QUESTION", "page: PAGE"
  const std::size_t colon = state.state.find(": ");
  if (colon != std::string::npos) return state.state.substr(colon + 2);
  for (const char* const page : {"instructions", "practice begins", "block begins", "rest"}) {
    if (state.state == page) return "space bar continues";
  }
  if (state.state == "end") return "space bar ends it";
  if (state.state != "homing") return {};
  if (state.sample.waiting == servo::Waiting::for_distance) return "stylus too near: move it away";
  if (state.sample.waiting == servo::Waiting::for_return) return "stylus must go to the start";
  if (state.sample.waiting == servo::Waiting::for_rest) return "stylus must rest: hold it still";
  return {};
}

std::string trial_of(const ConsoleState& state) {
  if (state.trials <= 0) return "-";
  return std::to_string(state.trial) + (state.about ? " of about " : " of ") +
         std::to_string(std::max(state.trials, state.trial));
}

std::string level_text(const ConsoleState& state) {
  if (state.level.empty()) return "-";
  return (state.level_name.empty() ? "" : state.level_name + " ") + state.level;
}

std::string shortened(const std::string& words, double room,
                      const std::function<double(const std::string&)>& width) {
  if (width(words) <= room) return words;
  std::string cut = words;
  while (!cut.empty()) {
    while (continues_character(cut.back())) cut.pop_back();
    cut.pop_back();
    if (width(cut + "\u2026") <= room) return cut + "\u2026";
  }
  return {};
}

double fraction_done(const ConsoleState& state) {
  if (state.trials <= 0) return 0;
  const bool over = state.seconds_left > 0 || state.state == "rest" ||
                    state.state == "block begins" || state.state == "end" ||
                    state.state.find(": ") != std::string::npos;
  return std::clamp((state.trial - (over ? 0.0 : 1.0)) / state.trials, 0.0, 1.0);
}

bool forces_not_yet_on(const ConsoleState& state) {
  const servo::DeviceTrouble trouble = state.sample.trouble;
  return !state.checklist.steps.empty() && state.fault.empty() &&
         trouble != servo::DeviceTrouble::unplugged && trouble != servo::DeviceTrouble::silent;
}

std::string forces_text(const ConsoleState& state) {
  const bool off = (state.sample.faults & servo::servo_fault::kTripped) != 0;
  if (!off) return state.held_by.empty() ? "No fault" : state.held_by;
  if (forces_not_yet_on(state)) return "Forces are off: none is needed yet";
  if (!state.held_by.empty()) return "Forces are off: " + state.held_by;
  return "Forces are off: " + forces_off_reason(state) + "; next: '" +
         button_label(ConsoleCommand::Kind::clear_fault) + "'";
}

std::string axis_label(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string power_words(double watts) {
  if (!std::isfinite(watts)) return "-";
  char text[64];
  std::snprintf(text, sizeof text, "%.1f mW %s the hand", 1e3 * std::abs(watts),
                watts < 0 ? "out of" : "into");
  return text;
}

std::string duration_text(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return "-";
  const auto two = [](long n) { return (n < 10 ? "0" : "") + std::to_string(n); };
  const long all = std::lround(std::min(seconds, 1e9));
  if (all < 60) return std::to_string(all) + " s";
  if (all < 3600) return std::to_string(all / 60) + " min " + two(all % 60) + " s";
  return std::to_string(all / 3600) + " h " + two(all % 3600 / 60) + " min";
}

}  // namespace palpate::runner::display
