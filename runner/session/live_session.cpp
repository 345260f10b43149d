#include "runner/session/live_session.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

namespace palpate::runner {
namespace {

constexpr double kSecond_ns = 1e9;
constexpr std::int64_t kNap_ns = 5'000'000;
constexpr std::int64_t kFrame_ns = 33'000'000;  // of the console
constexpr std::size_t kMostMessages = 200;

double largest_reach(const LiveSession::Parts& parts) {
  double reach = 0;
  for (std::size_t i = 0; i < parts.protocol.stimuli.size(); ++i)
    reach = std::max(reach, parts.library.reach(static_cast<int>(i)));
  return reach;
}

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
      return nullptr;  // what was shown last
    case Session::State::end:
      return "end";
  }
  return "";
}

}  // namespace

LiveSession::LiveSession(const Parts& parts, const data::ClockStamp& stamp, const SessionPlan& plan)
    : parts_(parts),
      respondent_(parts.protocol, parts.screen, *this, parts.clock, parts.answer_by),
      session_({parts.protocol, parts.library, parts.servo, parts.clock, respondent_, parts.record,
                this, largest_reach(parts)},
               plan, stamp),
      forces_(parts.servo, parts.guard, parts.clock),
      started_ns_(parts.clock.now_ns()) {
  state_.study = parts.protocol.name;
  state_.participant = marker_.participant = parts.record.participant().code;
  state_.session = marker_.session = parts.record.session();
  for (const protocols::StimulusSpec& stimulus : parts.protocol.stimuli)
    state_.scores.push_back({stimulus.name, 0, 0});
}

LiveSession::Outcome LiveSession::run() {
  Outcome outcome;
  try {
    outcome = go_through();
  } catch (const data::StoreError&) {
    forces_.off();
    throw;
  }
  take_last_words(outcome);
  outcome.recorded = session_.plan().done();
  outcome.trials = session_.plan().size();
  stop_noise();
  if (outcome.end == data::RunEnd::withdrawn) parts_.record.begin();  // whenever it comes
  const std::int64_t now = parts_.clock.now_ns();
  for (const std::string& text : parts_.record.waiting()) {
    if (text.front() != '{') outcome.unkept.push_back(text);
  }
  if (!outcome.reason.empty()) parts_.record.note(now, "ended: " + outcome.reason);
  parts_.record.note(now, to_json_text(parts_.servo.health(), parts_.protocol.servo_rate));
  parts_.record.end(outcome.end, now);
  show_console();
  if (outcome.end != data::RunEnd::done)
    respondent_.show_message("");  // it was not the last object
  return outcome;
}

LiveSession::Outcome LiveSession::go_through() {
  while (session_.state() != Session::State::end) {
    try {
      between_trials();
      session_.step();
    } catch (const SessionFault& fault) {
      if (const int signal = parts_.end_requested()) {
        return {data::RunEnd::aborted, std::string("signal: ") + strsignal(signal), 0, 0, true};
      }
      stop_noise();
      if (fault.trouble == DeviceTrouble::guard_lost)
        return {data::RunEnd::aborted, fault.reason, 0, 0, true};
      hold(fault.reason, fault.passed(), fault.trouble);
      say(std::string(fault.what()) + "; " + ways_on());
    } catch (const EndOfSession& end) {
      if (session_.plan().finished() && end.end != data::RunEnd::withdrawn) break;
      return {end.end, end.what(), 0, 0, end.failed};
    }
  }
  return {};
}

/// What was said at the same time as the end, or right after it, counts as well.
void LiveSession::take_last_words(Outcome& outcome) {
  for (ConsoleCommand& command : parts_.console.commands()) commands_.push_back(std::move(command));
  for (const ConsoleCommand& command : std::exchange(commands_, {})) {
    if (command.kind == ConsoleCommand::Kind::note) note(command.time_ns, command.text);
    if (command.kind != ConsoleCommand::Kind::quit) continue;
    const EndOfSession end = end_by_experimenter(command.text);
    if (end.end == data::RunEnd::withdrawn) outcome = {end.end, end.what(), 0, 0, false};
  }
}

void LiveSession::between_trials() {
  const Session::State now = session_.state();
  if (now == Session::State::response) return;  // a trial that was shown is recorded
  attend();
  stop_if_due();
  const auto& longest = parts_.protocol.sessions.max_minutes;
  const double elapsed = static_cast<double>(parts_.clock.now_ns() - started_ns_) / kSecond_ns;
  if (longest && elapsed > *longest * 60)
    throw EndOfSession(data::RunEnd::paused,
                       "the session has lasted as long as the protocol allows");
  respondent_.set_progress(session_.plan().done(), session_.plan().size());
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
    throw EndOfSession(data::RunEnd::paused, "stopped by the experimenter, to be continued");
}

void LiveSession::wait_while_held() {
  if (hold_ == Hold::none) return;
  stop_noise();
  const auto& texts = parts_.protocol.texts;
  const bool by_fault = hold_ != Hold::pause || texts.break_text.empty();
  respondent_.show_message(by_fault ? texts.wait : texts.break_text);
  while (hold_ != Hold::none) {
    respondent_.tend();
    state_.state = hold_ == Hold::pause ? "paused" : held_state_;
    state_.held_by = held_reason_ + (held_reason_.empty() ? "" : "; ") + ways_on();
    attend();
    stop_if_due();
    parts_.clock.wait_until(parts_.clock.now_ns() + kNap_ns);
  }
  state_.held_by.clear();
  held_reason_.clear();
}

void LiveSession::attend() {
  if (const int signal = parts_.end_requested())
    throw EndOfSession(data::RunEnd::aborted, std::string("signal: ") + strsignal(signal), true);
  for (ConsoleCommand& command : parts_.console.commands()) commands_.push_back(std::move(command));
  while (!commands_.empty()) {  // one of them may throw: the rest is obeyed later
    const ConsoleCommand command = std::move(commands_.front());
    commands_.pop_front();
    obey(command);
  }
  watch_noise();
  watch_device();
  if (!parts_.screen.open())
    throw EndOfSession(data::RunEnd::aborted, "the participant's screen was closed", true);
  if (parts_.clock.now_ns() - shown_ns_ >= kFrame_ns) show_console();
  end_with_the_guard();
}

void LiveSession::end_with_the_guard() const {
  if (state_.sample.trouble == DeviceTrouble::guard_lost)
    throw EndOfSession(data::RunEnd::aborted, advice(DeviceTrouble::guard_lost), true);
}

/// In a break no trial would tell of a device that is gone.
void LiveSession::watch_device() {
  if (in_trial_ || hold_ >= Hold::passed || !forces_.device_is_gone()) return;
  const DeviceTrouble trouble = forces_.newest().trouble;
  const std::string reason = trip_reason(servo_fault::kDeviceLost, trouble);
  hold(reason, false, trouble);
  say(reason + "; " + ways_on());
}

void LiveSession::obey(const ConsoleCommand& command) {
  using Kind = ConsoleCommand::Kind;
  switch (command.kind) {
    case Kind::pause:
      pause();
      say(in_trial_ ? "pause after this trial" : "paused");
      break;
    case Kind::go_on:
      go_on();
      break;
    case Kind::repeat_trial:
      if (in_trial_) throw TrialCutOff("repeated by the experimenter");
      say("no trial is under way");
      break;
    case Kind::stop_after_trial:
    case Kind::stop_after_block:
      plan_stop(command.kind);
      break;
    case Kind::emergency_zero:
      forces_.off();
      zero_asked_by_ = " by " + command.text;
      state_.fault = trip_reason(servo_fault::kEmergency, DeviceTrouble::none) + zero_asked_by_;
      note(command.time_ns, "emergency zero: " + command.text);
      say("EMERGENCY" + zero_asked_by_ + ": forces are off until the fault is cleared");
      if (!in_trial_)
        hold(trip_reason(servo_fault::kEmergency, DeviceTrouble::none), false, DeviceTrouble::none);
      break;
    case Kind::clear_fault:
      clear_fault(command.time_ns);
      break;
    case Kind::note:
      note(command.time_ns, command.text);
      break;
    case Kind::quit:
      throw end_by_experimenter(command.text);
  }
}

void LiveSession::pause() { hold_ = std::max(hold_, Hold::pause); }

void LiveSession::hold(const std::string& reason, bool passed, DeviceTrouble trouble) {
  hold_ = passed ? Hold::passed : Hold::fault;
  held_state_ = trouble == DeviceTrouble::guard_late ? "paused" : "fault";
  const bool asked = reason == trip_reason(servo_fault::kEmergency, DeviceTrouble::none);
  held_reason_ = reason + (asked ? zero_asked_by_ : "");
  state_.fault = held_reason_;
}

std::string LiveSession::ways_on() const {
  const std::string go = parts_.console.name_of(ConsoleCommand::Kind::go_on);
  if (hold_ != Hold::fault) return go + " goes on";
  return parts_.console.name_of(ConsoleCommand::Kind::clear_fault) + ", then " + go + ", goes on";
}

bool LiveSession::allow_forces() {
  const DeviceTrouble before = forces_.newest().trouble;
  if (parts_.guard != nullptr &&
      (before == DeviceTrouble::unplugged || before == DeviceTrouble::silent))
    say("opening the device again");
  const std::string trouble = forces_.allow([this] { return parts_.end_requested() != 0; });
  state_.sample = forces_.newest();
  end_with_the_guard();
  if (trouble.empty()) {
    state_.fault.clear();
    return true;
  }
  hold(trouble, false, state_.sample.trouble);
  say("not cleared, forces stay off: " + trouble + "; after that " + ways_on());
  return false;
}

void LiveSession::clear_fault(std::int64_t at_ns) {
  if (in_trial_ || hold_ < Hold::passed) {
    say("there is no fault to clear");
  } else if (allow_forces()) {
    hold_ = Hold::pause;
    held_reason_.clear();
    note(at_ns, "fault cleared");
    say("fault cleared; " + ways_on() + " when all are ready");
  }
}

void LiveSession::go_on() {
  if (hold_ == Hold::none) {
    say("nothing is paused");
  } else if (hold_ == Hold::fault) {
    say("forces are off: clear the fault first (" +
        parts_.console.name_of(ConsoleCommand::Kind::clear_fault) + ")");
  } else if (hold_ == Hold::pause || allow_forces()) {
    hold_ = Hold::none;
    say("going on");
  }
}

void LiveSession::plan_stop(ConsoleCommand::Kind kind) {
  const Stop asked =
      kind == ConsoleCommand::Kind::stop_after_trial ? Stop::after_trial : Stop::after_block;
  if (stop_ == asked) {
    stop_ = Stop::no;
    state_.stop_plan.clear();
    say("the stop is taken back: the session goes on");
    return;
  }
  stop_ = asked;
  state_.stop_plan = stop_ == Stop::after_trial ? "after this trial" : "after this block";
  say("the session will stop " + state_.stop_plan + " (" + parts_.console.name_of(kind) +
      " again takes it back)");
}

bool LiveSession::start_noise() {
  if (parts_.noise == nullptr || noise_noted_) return true;
  try {
    parts_.noise->turn_on();
  } catch (const SoundError& error) {
    say(error.what());
    pause();
    return false;
  }
  noise_noted_ = true;
  parts_.record.note(parts_.clock.now_ns(), to_json_text(*parts_.noise));
  return true;
}

void LiveSession::stop_noise() {
  if (!noise_noted_) return;
  noise_noted_ = false;
  parts_.noise->turn_off();
  const NoiseReport heard = parts_.noise->report();
  parts_.record.note(parts_.clock.now_ns(), to_json_text(heard));
  if (heard.underruns > 0)
    say("the masking noise had " + std::to_string(heard.underruns) + " gaps");
}

void LiveSession::watch_noise() {
  if (!noise_noted_ || !parts_.noise->failed()) return;
  say(parts_.noise->report().trouble);
  stop_noise();
  pause();
  if (in_trial_) throw TrialCutOff("the masking noise stopped");
}

void LiveSession::note(std::int64_t at_ns, const std::string& text) {
  try {
    parts_.record.note(at_ns, text);
    say("note: " + text);
  } catch (const data::StoreRefused& refused) {  // empty, or no UTF-8
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
  state_.seconds_left = respondent_.seconds_left();
  state_.elapsed = static_cast<double>(shown_ns_ - started_ns_) / kSecond_ns;
  state_.trials = static_cast<int>(plan.size());
  state_.blocks = plan.blocks();
  state_.remaining = seconds_per_trial_ * static_cast<double>(plan.size() - plan.done());
  state_.sample = forces_.newest();
  if (in_trial_) {
    state_.state = feeling_ ? "trial" : "homing";
  } else if (state_.held_by.empty() && word(session_.state()) != nullptr) {
    state_.state = word(session_.state());
  }
  state_.ticks = parts_.servo.health().ticks();
  state_.missed_ticks = parts_.servo.health().missed_ticks();
  state_.longest_period_ns = parts_.servo.health().longest_period_ns();
  parts_.console.show(state_);
}

void LiveSession::began(const protocols::Trial& trial) {
  const protocols::StimulusSpec& stimulus =
      parts_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)];
  in_trial_ = true;
  feeling_ = false;
  began_ns_ = parts_.clock.now_ns();
  stimuli::ObjectSpec object = stimulus.object;
  object.pose = {trial.orientation * object.pose.position,
                 trial.orientation * object.pose.orientation};
  state_.objects = std::make_shared<const std::vector<stimuli::ObjectSpec>>(1, std::move(object));
  state_.shape = stimulus.name;
  state_.practice = trial.practice;
  state_.renderer = protocols::to_string(trial.renderer);
  state_.block = marker_.block = trial.block;
  state_.trial = marker_.trial = trial.trial;
  marker_.shape = state_.shape;
  marker_.renderer = state_.renderer;
  marker_.attempt = 0;
  marker_.response.clear();
  show_console();
}

void LiveSession::onset(const data::TrialRecord& so_far) {
  feeling_ = true;
  if (parts_.noise != nullptr) parts_.noise->tone();
  marker_.kind = Marker::Kind::trial_start;
  marker_.attempt = so_far.attempt;
  marker_.time_ns = so_far.onset_ns;
  parts_.markers.send(marker_);
}

void LiveSession::first_contact(const data::TrialRecord&, std::int64_t time_ns) {
  marker_.kind = Marker::Kind::first_contact;
  marker_.time_ns = time_ns;
  parts_.markers.send(marker_);
}

void LiveSession::answered(const data::TrialRecord& record) {
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

void LiveSession::count(const data::TrialRecord& record) {
  if (record.practice) return;
  for (ShapeScore& score : state_.scores) {
    if (score.shape != record.shape) continue;
    ++score.shown;
    score.right += record.correct ? 1 : 0;
  }
}

void LiveSession::recorded(const data::TrialRecord& record) {
  state_.answer = record.timed_out ? "none in time"
                                   : record.response + (record.correct ? ", right" : ", wrong");
  count(record);
  state_.times.push_back(record.response_time);
  const double took = static_cast<double>(parts_.clock.now_ns() - began_ns_) / kSecond_ns;
  ++timed_trials_;
  seconds_per_trial_ += (took - seconds_per_trial_) / timed_trials_;
  if (!record.response.empty() && !record.first_contact_time) {
    say("trial " + std::to_string(record.trial) + " was answered before the first contact");
  }
}

}  // namespace palpate::runner
