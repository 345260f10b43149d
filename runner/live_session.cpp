#include "runner/live_session.h"

#include <cstring>
#include <memory>
#include <utility>
#include <vector>

namespace palpate {
namespace {

constexpr double kSecond_ns = 1e9;
constexpr std::int64_t kNap_ns = 5'000'000;
constexpr std::int64_t kFrame_ns = 33'000'000;  // of the console
constexpr std::size_t kMostMessages = 200;

const char* word(Session::State state) {
  switch (state) {
    case Session::State::instruction:
      return "instructions";
    case Session::State::practice:
      return "practice begins";
    case Session::State::block:
      return "block begins";
    case Session::State::rest:
      return "rest";
    case Session::State::trial:
    case Session::State::response:
      return "trial";
    case Session::State::end:
      return "end";
  }
  return "";
}

}  // namespace

LiveSession::LiveSession(const Parts& parts, const Participant& participant, const Run& run,
                         const ClockStamp& stamp, const SessionPlan& plan)
    : parts_(parts),
      run_(run),
      respondent_(parts.protocol, parts.screen, *this, parts.clock, parts.answer_by),
      log_(parts.store, run),
      session_({parts.protocol, parts.library, parts.servo, parts.clock, respondent_, log_, this},
               plan, stamp),
      started_ns_(parts.clock.now_ns()) {
  state_.study = parts.protocol.name;
  state_.participant = participant.code;
  state_.session = run.session;
  marker_.participant = participant.code;
  marker_.session = run.session;
}

LiveSession::Outcome LiveSession::run() {
  Outcome outcome;
  try {
    outcome = go_through();
  } catch (const StoreError&) {
    zero_force();
    throw;
  }
  outcome.recorded = session_.plan().done();
  outcome.trials = session_.plan().size();
  stop_noise();
  const std::int64_t now = parts_.clock.now_ns();
  if (!outcome.reason.empty()) parts_.store.add_note(run_, now, "ended: " + outcome.reason);
  parts_.store.add_note(run_, now, to_json_text(parts_.servo.health(), parts_.protocol.servo_rate));
  parts_.store.end_run(run_, outcome.end, now);
  if (outcome.end != RunEnd::done) respondent_.show_message(parts_.protocol.texts.end);
  return outcome;
}

LiveSession::Outcome LiveSession::go_through() {
  while (session_.state() != Session::State::end) {
    try {
      between_trials();
      session_.step();
    } catch (const SessionFault& fault) {
      if (const int signal = parts_.end_requested()) {
        return {RunEnd::aborted, std::string("signal: ") + strsignal(signal), 0, 0, true};
      }
      faulted_ = paused_ = true;
      stop_noise();
      say(fault.what());
    } catch (const EndOfSession& end) {
      if (session_.plan().finished()) break;
      return {end.end, end.what(), 0, 0, end.failed};
    }
  }
  return {};
}

void LiveSession::between_trials() {
  const Session::State now = session_.state();
  if (now == Session::State::response) return;  // a trial that was shown is recorded
  attend();
  stop_if_due();
  const auto& longest = parts_.protocol.sessions.max_minutes;
  const double elapsed = static_cast<double>(parts_.clock.now_ns() - started_ns_) / kSecond_ns;
  if (longest && elapsed > *longest * 60)
    throw EndOfSession(RunEnd::paused, "the session has lasted as long as the protocol allows");
  state_.state = word(now);
  if (now != Session::State::trial) stop_noise();  // a page to read, and perhaps to talk about
  do {
    wait_while_held();
  } while (now == Session::State::trial && !start_noise());
}

void LiveSession::stop_if_due() {
  const Session::State now = session_.state();
  const bool block_begins = now == Session::State::practice || now == Session::State::block;
  const bool began = session_.plan().done() > 0 || now != Session::State::instruction;
  if (stop_ == Stop::after_trial || (stop_ == Stop::after_block && block_begins && began))
    throw EndOfSession(RunEnd::paused, "stopped by the experimenter, to be continued");
}

void LiveSession::wait_while_held() {
  if (!paused_) return;
  stop_noise();
  respondent_.show_message(parts_.protocol.texts.break_text);
  while (paused_) {
    state_.state = faulted_ ? "fault" : "paused";
    attend();
    stop_if_due();
    parts_.clock.wait_until(parts_.clock.now_ns() + kNap_ns);
  }
  state_.state = word(session_.state());
}

void LiveSession::attend() {
  if (const int signal = parts_.end_requested())
    throw EndOfSession(RunEnd::aborted, std::string("signal: ") + strsignal(signal), true);
  for (ConsoleCommand& command : parts_.console.commands()) commands_.push_back(std::move(command));
  while (!commands_.empty()) {  // one of them may throw: the rest is obeyed later
    const ConsoleCommand command = std::move(commands_.front());
    commands_.pop_front();
    obey(command);
  }
  watch_noise();
  if (!parts_.screen.open())
    throw EndOfSession(RunEnd::aborted, "the participant's screen was closed", true);
  if (parts_.clock.now_ns() - shown_ns_ >= kFrame_ns) show_console();
}

void LiveSession::obey(const ConsoleCommand& command) {
  using Kind = ConsoleCommand::Kind;
  switch (command.kind) {
    case Kind::pause:
      paused_ = true;
      say(in_trial_ ? "pause after this trial" : "paused");
      break;
    case Kind::go_on:
      if (faulted_) {
        say("forces are off: clear the fault first");
      } else if (std::exchange(paused_, false)) {
        say("going on");
      }
      break;
    case Kind::repeat_trial:
      if (in_trial_) throw TrialCutOff("repeated by the experimenter");
      say("no trial is under way");
      break;
    case Kind::stop_after_trial:
    case Kind::stop_after_block:
      stop_ = command.kind == Kind::stop_after_trial ? Stop::after_trial : Stop::after_block;
      state_.stop_plan = stop_ == Stop::after_trial ? "after this trial" : "after this block";
      say("the session will stop " + state_.stop_plan);
      break;
    case Kind::emergency_zero:
      zero_force();
      note(command.time_ns, "emergency zero");
      say("EMERGENCY: forces are off until the fault is cleared");
      if (!in_trial_) faulted_ = paused_ = true;
      break;
    case Kind::clear_fault:
      parts_.servo.clear_fault();
      if (std::exchange(faulted_, false)) {
        note(command.time_ns, "fault cleared");
        say("fault cleared; go on when ready");
      }
      break;
    case Kind::note:
      note(command.time_ns, command.text);
      break;
    case Kind::quit:
      throw command.text == "withdrawn"
          ? EndOfSession(RunEnd::withdrawn, "the participant withdrew")
          : EndOfSession(RunEnd::aborted, "ended by the experimenter" +
                                              (command.text.empty() ? "" : ": " + command.text));
  }
}

void LiveSession::zero_force() {
  if (parts_.guard != nullptr) parts_.guard->emergency_zero();
  parts_.servo.emergency_zero();
}

bool LiveSession::start_noise() {
  if (parts_.noise == nullptr || noise_noted_) return true;
  try {
    parts_.noise->turn_on();
  } catch (const SoundError& error) {
    say(error.what());
    paused_ = true;
    return false;
  }
  noise_noted_ = true;
  parts_.store.add_note(run_, parts_.clock.now_ns(), to_json_text(*parts_.noise));
  return true;
}

void LiveSession::stop_noise() {
  if (!noise_noted_) return;
  noise_noted_ = false;
  parts_.noise->turn_off();
  const NoiseReport heard = parts_.noise->report();
  parts_.store.add_note(run_, parts_.clock.now_ns(), to_json_text(heard));
  if (heard.underruns > 0)
    say("the masking noise had " + std::to_string(heard.underruns) + " gaps");
}

void LiveSession::watch_noise() {
  if (!noise_noted_ || !parts_.noise->failed()) return;
  say(parts_.noise->report().trouble);
  stop_noise();
  paused_ = true;
  if (in_trial_) throw TrialCutOff("the masking noise stopped");
}

void LiveSession::note(std::int64_t at_ns, const std::string& text) {
  try {
    parts_.store.add_note(run_, at_ns, text);
    say("note: " + text);
  } catch (const StoreRefused& refused) {  // empty, or no UTF-8
    say(refused.what());
  }
}

void LiveSession::say(const std::string& message) {
  if (state_.messages.size() >= kMostMessages) {
    state_.messages.erase(state_.messages.begin());
    ++state_.older_messages;
  }
  state_.messages.push_back(message);
  show_console();
}

void LiveSession::show_console() {
  shown_ns_ = parts_.clock.now_ns();
  const SessionPlan& plan = session_.plan();
  state_.elapsed = static_cast<double>(shown_ns_ - started_ns_) / kSecond_ns;
  state_.trials = static_cast<int>(plan.size());
  state_.blocks = plan.blocks();
  state_.remaining = seconds_per_trial_ * static_cast<double>(plan.size() - plan.done());
  parts_.servo.latest(state_.sample);
  if (in_trial_) state_.state = feeling_ ? "trial" : "homing";
  state_.ticks = parts_.servo.health().ticks();
  state_.missed_ticks = parts_.servo.health().missed_ticks();
  state_.longest_period_ns = parts_.servo.health().longest_period_ns();
  parts_.console.show(state_);
}

void LiveSession::began(const Trial& trial) {
  const StimulusSpec& stimulus = parts_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)];
  in_trial_ = true;
  feeling_ = false;
  began_ns_ = parts_.clock.now_ns();
  ObjectSpec object = stimulus.object;
  object.pose = {trial.orientation * object.pose.position,
                 trial.orientation * object.pose.orientation};
  state_.objects = std::make_shared<const std::vector<ObjectSpec>>(1, std::move(object));
  state_.shape = stimulus.name;
  state_.renderer = to_string(trial.renderer);
  state_.block = marker_.block = trial.block;
  state_.trial = marker_.trial = trial.trial;
  marker_.shape = state_.shape;
  marker_.renderer = state_.renderer;
  marker_.attempt = 0;
  marker_.response.clear();
  show_console();
}

void LiveSession::onset(const TrialRecord& so_far) {
  feeling_ = true;
  marker_.kind = Marker::Kind::trial_start;
  marker_.attempt = so_far.attempt;
  marker_.time_ns = so_far.onset_ns;
  parts_.markers.send(marker_);
}

void LiveSession::first_contact(const TrialRecord&, std::int64_t time_ns) {
  marker_.kind = Marker::Kind::first_contact;
  marker_.time_ns = time_ns;
  parts_.markers.send(marker_);
}

void LiveSession::answered(const TrialRecord& record) {
  in_trial_ = false;
  marker_.kind = record.timed_out ? Marker::Kind::time_out : Marker::Kind::response;
  marker_.response = record.response;
  marker_.time_ns = record.response_ns;
  parts_.markers.send(marker_);
}

void LiveSession::cut_off(const std::string& reason) {
  in_trial_ = false;
  marker_.kind = Marker::Kind::cut_off;
  marker_.time_ns = parts_.clock.now_ns();
  parts_.markers.send(marker_);
  say("trial " + std::to_string(marker_.trial) + " was cut off: " + reason);
}

void LiveSession::recorded(const TrialRecord& record) {
  state_.times.push_back(record.response_time);
  const double took = static_cast<double>(parts_.clock.now_ns() - began_ns_) / kSecond_ns;
  ++timed_trials_;
  seconds_per_trial_ += (took - seconds_per_trial_) / timed_trials_;
  if (!record.response.empty() && !record.first_contact_time) {
    say("trial " + std::to_string(record.trial) + " was answered before the first contact");
  }
}

}  // namespace palpate
