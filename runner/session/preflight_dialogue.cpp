#include "runner/session/preflight_dialogue.h"

#include <cstdint>
#include <utility>

#include "runner/session/live_forces.h"
#include "runner/session/session_end.h"

namespace palpate::runner {
namespace {

using Kind = ConsoleCommand::Kind;

// What is missing changes while the stylus moves: no new instruction before one can be read.
constexpr std::int64_t kReading_ns = 1'000'000'000;

PreflightNeeds needs_of(const LiveStation& station) {
  PreflightNeeds needs;
  if (station.guard == nullptr) return needs;
  needs.reach = largest_reach(station);
  needs.push = station.direction_check;
  needs.device_limit = station.device.max_force;
  if (station.answer_by == AnswerBy::buttons)
    needs.buttons = static_cast<int>(station.protocol.response.keys.size());
  return needs;
}

class PreflightDialogue {
 public:
  PreflightDialogue(const LiveStation& station, const std::vector<std::string>& news)
      : station_(station),
        preflight_(needs_of(station)),
        told_ns_(station.clock.now_ns() - kReading_ns / 2) {  // what is well need not be said
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
      station_.screen.keys();  // none answers yet
      take_commands();
      end_if_due();
      if (preflight_.push_due() && state_.fault.empty()) check_force_direction();
      show();
    }
    station_.servo_thread.clear_fault();  // before homing there were no readings
    station_.console.show(state_);
    std::vector<std::string> findings = preflight_.findings();
    findings.insert(findings.end(), emergencies_.begin(), emergencies_.end());
    return {findings, state_.messages};
  }

 private:
  void take_commands() {
    std::vector<ConsoleCommand> commands = std::exchange(while_pushed_, {});
    for (ConsoleCommand& more : station_.console.commands()) commands.push_back(std::move(more));
    for (const ConsoleCommand& command : commands) {
      obey(command);
      if (!state_.fault.empty()) continue;
      // What was pressed during the push does not tell that it was felt.
      if (command.kind == Kind::go_on && command.time_ns >= pushed_ns_) preflight_.skip();
      if (command.kind == Kind::repeat_trial) preflight_.repeat();
    }
  }

  /// What is obeyed at any step. \throws EndOfSession
  void obey(const ConsoleCommand& command) {
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
      case Kind::stop_after_trial:
      case Kind::stop_after_block:
        say("there is no trial yet");
        break;
      case Kind::clear_fault:
        clear_fault();
        break;
      case Kind::go_on:
      case Kind::repeat_trial:
        break;
    }
  }

  void take_note(const ConsoleCommand& note) {
    try {
      station_.record.note(note.time_ns, note.text);
      say("note: " + note.text);
    } catch (const data::StoreRefused& refused) {  // empty, or no UTF-8
      say(refused.what());
    }
  }

  void clear_fault() {
    LiveForces forces(station_.servo_thread, station_.guard, station_.clock);
    const std::string trouble = forces.allow([this] { return station_.end_requested() != 0; });
    if (trouble.empty()) state_.fault.clear();
    say(trouble.empty() ? "the device works" : "not cleared: " + trouble);
  }

  /// Also where the push or the homing is waited for. \throws EndOfSession
  void end_if_due() const {
    const DeviceTrouble trouble = state_.sample.trouble;
    if (station_.end_requested() != 0)
      throw EndOfSession(data::RunEnd::aborted, "a signal asked for the end", true);
    if (!station_.screen.open())
      throw EndOfSession(data::RunEnd::aborted, "the participant's screen was closed", true);
    if (trouble == DeviceTrouble::guard_lost)
      throw EndOfSession(data::RunEnd::aborted, advice(trouble), true);
  }

  void check_force_direction() {
    station_.servo_thread.clear_fault();  // before homing there were no readings
    preflight_.pushed(station_.direction_check->push(station_.servo_thread, [this] {
      bool quit = station_.end_requested() != 0;
      for (ConsoleCommand& more : station_.console.commands()) {
        quit = quit || more.kind == Kind::quit;
        while_pushed_.push_back(std::move(more));
      }
      return quit;
    }));
    pushed_ns_ = station_.clock.now_ns();
  }

  Checklist checklist() const {
    Checklist list = preflight_.checklist();
    const DeviceTrouble trouble = state_.sample.trouble;
    // What takes more than the hand that is at the grip.
    if (needs_reopening(trouble))
      list.instruction += "; after that " + station_.console.name_of(Kind::clear_fault);
    if (!state_.fault.empty()) {  // nothing else is obeyed before
      list.instruction = "forces are off: " + state_.fault +
                         "; next: " + station_.console.name_of(Kind::clear_fault);
      list.choices.clear();
    }
    return list;
  }

  void show() {
    Checklist list = checklist();
    const std::int64_t now = station_.clock.now_ns();
    if (list.instruction != told_ && now - told_ns_ > kReading_ns) {
      told_ = list.instruction;
      told_ns_ = now;
      Page page;
      page.kind = Page::Kind::checklist;
      page.checklist = list;
      station_.screen.show(page);
      state_.checklist = std::move(list);
    }
    station_.console.show(state_);
  }

  void say(const std::string& message) { state_.messages.push_back(message); }

  const LiveStation& station_;
  Preflight preflight_;
  ConsoleState state_;
  std::string told_;                          ///< the instruction on show
  std::int64_t told_ns_;                      ///< since then; session clock
  std::int64_t pushed_ns_ = 0;                ///< when the last push ended; session clock
  std::vector<ConsoleCommand> while_pushed_;  ///< that came during a push: not obeyed yet
  std::vector<std::string> emergencies_;
};

}  // namespace

PreflightResult run_preflight(const LiveStation& station, const std::vector<std::string>& news) {
  return PreflightDialogue(station, news).run();
}

}  // namespace palpate::runner
