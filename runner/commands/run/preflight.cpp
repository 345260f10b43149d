#include "runner/commands/run/preflight.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "runner/session/preflight.h"

namespace palpate::runner {

namespace {

using Kind = ConsoleCommand::Kind;

void take_note(RunRecord& record, const ConsoleCommand& note, std::vector<std::string>& messages) {
  try {
    record.note(note.time_ns, note.text);
    messages.push_back("note: " + note.text);
  } catch (const data::StoreRefused& refused) {  // empty, or no UTF-8
    messages.push_back(refused.what());
  }
}

/// What is obeyed at any step. \throws EndOfSession
void obey(const RunParts& at, RunRecord& record, const ConsoleCommand& command,
          ConsoleState& state) {
  std::vector<std::string>& messages = state.messages;
  if (command.kind == Kind::quit) throw end_by_experimenter(command.text);
  if (command.kind == Kind::emergency_zero) {
    state.fault = "zero force was asked for by " + command.text;
    messages.push_back("EMERGENCY by " + command.text +
                       ": forces are off until the fault is cleared");
  }
  if (command.kind == Kind::note) take_note(record, command, messages);
  if (command.kind == Kind::pause || command.kind == Kind::stop_after_trial ||
      command.kind == Kind::stop_after_block)
    messages.push_back("there is no trial yet");
  if (command.kind != Kind::clear_fault) return;
  const std::string trouble = LiveForces(at.servo, at.guard, at.clock).allow([&at] {
    return at.signals.end_requested() != 0;
  });
  if (trouble.empty()) state.fault.clear();
  messages.push_back(trouble.empty() ? "the device is well" : "not cleared: " + trouble);
}

/// What takes more than the hand that is at the grip.
std::string way_on(const RunParts& at, DeviceTrouble trouble) {
  if (trouble != DeviceTrouble::unplugged && trouble != DeviceTrouble::silent) return "";
  return "; after that " + at.display.console().name_of(Kind::clear_fault);
}

/// Also where the push or the homing is waited for. \throws EndOfSession
void end_if_due(const RunParts& at, const Sample& sample) {
  if (at.signals.end_requested() != 0)
    throw EndOfSession(data::RunEnd::aborted, "a signal asked for the end", true);
  if (!at.display.participant().open())
    throw EndOfSession(data::RunEnd::aborted, "the participant's screen was closed", true);
  if (sample.trouble == DeviceTrouble::guard_lost)
    throw EndOfSession(data::RunEnd::aborted, advice(sample.trouble), true);
}

}  // namespace

PreflightRecord go_through_preflight(const RunParts& at, RunRecord& record,
                                     const std::vector<std::string>& news) {
  PreflightNeeds needs;
  if (at.kind.has_force_feedback) {
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
  state.messages = news;
  for (const LimitedMaterial& one : at.limited) state.messages.push_back(one.text);
  std::string told;
  std::int64_t told_ns = at.clock.now_ns() - 500'000'000;  // what is well need not be said
  std::int64_t pushed_ns = 0;
  std::vector<std::string> emergencies;
  std::vector<ConsoleCommand> while_pushed;  // not obeyed yet
  while (preflight.step() != Preflight::Step::done || !state.fault.empty()) {
    at.clock.wait_until(at.clock.now_ns() + 5'000'000);
    if (at.servo.latest(state.sample)) preflight.add(state.sample);
    at.display.participant().keys();  // none answers yet
    std::vector<ConsoleCommand> commands = std::exchange(while_pushed, {});
    for (ConsoleCommand& more : at.display.console().commands()) commands.push_back(more);
    for (const ConsoleCommand& command : commands) {
      obey(at, record, command, state);
      if (command.kind == Kind::emergency_zero)
        emergencies.push_back("EMERGENCY by " + command.text);
      // What was pressed while it pushed does not tell that it was felt.
      const bool free = state.fault.empty();
      if (free && command.kind == ConsoleCommand::Kind::go_on && command.time_ns >= pushed_ns)
        preflight.skip();
      if (free && command.kind == ConsoleCommand::Kind::repeat_trial) preflight.repeat();
    }
    end_if_due(at, state.sample);
    if (preflight.push_due() && state.fault.empty()) {
      at.servo.clear_fault();  // before homing there were no readings
      preflight.pushed(at.push.give(at.servo, [&] {
        bool quit = at.signals.end_requested() != 0;
        for (ConsoleCommand& more : at.display.console().commands()) {
          quit = quit || more.kind == Kind::quit;
          while_pushed.push_back(std::move(more));
        }
        return quit;
      }));
      pushed_ns = at.clock.now_ns();
    }
    Checklist list = preflight.checklist();
    list.instruction += way_on(at, state.sample.trouble);
    if (!state.fault.empty()) {  // nothing else is obeyed before
      list.instruction = "forces are off: " + state.fault +
                         "; next: " + at.display.console().name_of(Kind::clear_fault);
      list.choices.clear();
    }
    const std::int64_t now = at.clock.now_ns();
    // What is missing changes while the stylus moves: no more often than one can read.
    if (list.instruction != told && now - told_ns > 1'000'000'000) {
      told = list.instruction;
      told_ns = now;
      Page page;
      page.kind = Page::Kind::checklist;
      page.checklist = list;
      at.display.participant().show(page);
      state.checklist = std::move(list);
    }
    at.display.console().show(state);
  }
  at.servo.clear_fault();  // before homing there were no readings
  at.display.console().show(state);
  std::vector<std::string> findings = preflight.findings();
  findings.insert(findings.end(), emergencies.begin(), emergencies.end());
  return {findings, state.messages};
}

}  // namespace palpate::runner
