#include "runner/commands/run_preflight.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "runner/preflight.h"

namespace palpate {

PreflightRecord go_through_preflight(const RunParts& at) {
  PreflightNeeds needs;
  if (at.kind.pushes) {
    for (std::size_t i = 0; i < at.protocol.stimuli.size(); ++i)
      needs.reach = std::max(needs.reach, at.library.reach(static_cast<int>(i)));
    needs.push = &at.push;
    needs.device_limit = at.device.max_force;
    if (at.settings.buttons) needs.buttons = static_cast<int>(at.protocol.response.keys.size());
  }
  Preflight preflight(needs);
  ConsoleState state;
  state.study = at.protocol.name;
  state.participant = at.participant.code;
  state.session = at.session;
  state.state = "pre-flight";
  for (const LimitedMaterial& one : at.limited) state.messages.push_back(one.text);
  std::string told;
  std::int64_t told_ns = at.clock.now_ns() - 500'000'000;  // what is well need not be said
  std::int64_t pushed_ns = 0;
  while (preflight.step() != Preflight::Step::done) {
    at.clock.wait_until(at.clock.now_ns() + 5'000'000);
    if (at.servo.latest(state.sample)) preflight.add(state.sample);
    for (const ConsoleCommand& command : at.display.console().commands()) {
      // What was pressed while it pushed does not tell that it was felt.
      if (command.kind == ConsoleCommand::Kind::go_on && command.time_ns >= pushed_ns)
        preflight.skip();
      if (command.kind == ConsoleCommand::Kind::repeat_trial) preflight.repeat();
      if (command.kind == ConsoleCommand::Kind::quit)
        throw EndOfSession(RunEnd::aborted, "ended by the experimenter");
    }
    if (at.signals.end_requested() != 0)
      throw EndOfSession(RunEnd::aborted, "a signal asked for the end", true);
    if (!at.display.participant().open())
      throw EndOfSession(RunEnd::aborted, "the participant's screen was closed", true);
    if (preflight.push_due()) {
      at.servo.clear_fault();  // before homing there were no readings
      preflight.pushed(at.push.give(at.servo, [&] { return at.signals.end_requested() != 0; }));
      pushed_ns = at.clock.now_ns();
    }
    const std::string instruction = preflight.instruction();
    const std::int64_t now = at.clock.now_ns();
    // What is missing changes while the stylus moves: no more often than one can read.
    if (instruction != told && now - told_ns > 1'000'000'000) {
      told = instruction;
      told_ns = now;
      state.messages.push_back(instruction);
    }
    at.display.console().show(state);
  }
  at.servo.clear_fault();  // before homing there were no readings
  at.display.console().show(state);
  return {preflight.findings(), state.messages};
}

}  // namespace palpate
