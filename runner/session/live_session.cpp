#include "runner/session/live_session.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace palpate::runner::session {
namespace {

EndOfSession end_by_signal(int signal) {
  return {data::RunEnd::aborted, std::string("signal: ") + strsignal(signal), true};
}

/// A question of a page; null: there is none. A consent has none.
const protocols::PageItem* item_of(const protocols::Protocol& protocol, const std::string& page,
                                   const std::string& name) {
  for (const protocols::PageSpec& one : protocol.pages) {
    for (const protocols::PageItem& item : one.items) {
      if (one.name == page && item.name == name) return &item;
    }
  }
  return nullptr;
}

}  // namespace

LiveSession::LiveSession(const LiveStation& station)
    : station_(station),
      forces_(station.servo_thread, station.guard, station.clock),
      hold_(station, forces_, [this](const std::string& message) { say(message); }),
      sound_(station, [this](const std::string& message) { say(message); }),
      signals_(station, station.markers, sound_, station.record.participant().code,
               station.record.session()),
      monitor_(station, {session_, respondent_, hold_, forces_, signals_}),
      respondent_(station.protocol, station.screen, *this, station.clock, station.answer_by),
      session_(station, respondent_, &monitor_, largest_reach(station)) {}

LiveSession::Outcome LiveSession::run() {
  Outcome outcome;
  try {
    outcome = run_trials();
  } catch (const data::StoreError&) {
    forces_.off();
    throw;
  }
  take_last_commands(outcome);
  outcome.recorded = session_.plan().done();
  outcome.trials = session_.plan().size();
  sound_.stop();
  RunRecord& record = station_.record;
  if (outcome.end == data::RunEnd::withdrawn) record.begin();  // at any time
  const std::int64_t now = station_.clock.now_ns();
  if (!outcome.reason.empty()) record.note(now, "ended: " + outcome.reason);
  record.note(now,
              servo::to_json_text(station_.servo_thread.health(), station_.protocol.servo_rate));
  if (const std::string places = station_.console.places(); !places.empty())
    record.note(now, places);
  record.end(outcome.end, now);
  monitor_.show();
  if (outcome.end != data::RunEnd::done)
    respondent_.show_message("");  // it was not the last object
  return outcome;
}

LiveSession::Outcome LiveSession::run_trials() {
  while (session_.state() != Session::State::end) {
    try {
      before_step();
      session_.step();
    } catch (const SessionFault& fault) {
      if (const int signal = station_.end_requested()) {
        const EndOfSession end = end_by_signal(signal);
        return {end.end, end.what(), 0, 0, end.failed};
      }
      sound_.stop();
      if (fault.trouble == servo::DeviceTrouble::guard_lost)
        return {data::RunEnd::aborted, fault.reason, 0, 0, true};
      hold_.hold(fault.reason, fault.is_transient(), fault.trouble);
      say(std::string(fault.what()) + "; " + hold_.how_to_continue());
    } catch (const EndOfSession& end) {
      const bool over = session_.plan().finished() && !session_.has_open_pages();
      if (over && end.end != data::RunEnd::withdrawn) break;
      return {end.end, end.what(), 0, 0, end.failed};
    }
  }
  return {};
}

/// Commands given at the time of the end, or right after it, count as well.
void LiveSession::take_last_commands(Outcome& outcome) {
  for (display::ConsoleCommand& command : station_.console.commands())
    commands_.push_back(std::move(command));
  for (const display::ConsoleCommand& command : std::exchange(commands_, {})) {
    if (command.kind == display::ConsoleCommand::Kind::note) note(command.time_ns, command.text);
    if (command.kind != display::ConsoleCommand::Kind::quit) continue;
    const EndOfSession end = end_by_experimenter(command.text);
    if (end.end == data::RunEnd::withdrawn) outcome = {end.end, end.what(), 0, 0, false};
  }
}

void LiveSession::before_step() {
  const Session::State now = session_.state();
  if (now == Session::State::response) return;  // a shown trial is recorded
  respondent_.set_progress(session_.plan().done(), monitor_.expected_trials());
  attend();
  stop_if_due();
  const auto& longest = station_.protocol.sessions.max_minutes;
  if (longest && monitor_.elapsed() > *longest * 60)
    throw EndOfSession(data::RunEnd::paused,
                       "the session has lasted as long as the protocol allows");
  if (now != Session::State::trial) sound_.stop();  // a page to read, and perhaps to discuss
  bool ready = false;
  while (!ready) {
    wait_while_held();
    ready = now != Session::State::trial || sound_.start();
    if (!ready) hold_.pause();
  }
}

void LiveSession::stop_if_due() {
  const Session::State now = session_.state();
  const bool block_begins = now == Session::State::practice || now == Session::State::block;
  const bool began = session_.plan().done() > 0 || now != Session::State::instruction;
  if (stop_ == Stop::after_trial || (stop_ == Stop::after_block && block_begins && began))
    throw EndOfSession(data::RunEnd::paused, "stopped by the experimenter, to be resumed");
}

void LiveSession::wait_while_held() {
  using Kind = SessionHold::Kind;
  if (hold_.kind() == Kind::none) return;
  sound_.stop();
  const auto& texts = station_.protocol.texts;
  const bool by_fault = hold_.kind() != Kind::pause || texts.break_text.empty();
  respondent_.show_message(by_fault ? texts.wait : texts.break_text);
  while (hold_.kind() != Kind::none) {
    respondent_.tend();
    monitor_.held();
    attend();
    stop_if_due();
    station_.clock.wait_until(station_.clock.now_ns() + kSessionNap_ns);
  }
  monitor_.going_on();
  hold_.forget_reason();
}

void LiveSession::attend() {
  if (const int signal = station_.end_requested()) throw end_by_signal(signal);
  for (display::ConsoleCommand& command : station_.console.commands())
    commands_.push_back(std::move(command));
  while (!commands_.empty()) {  // a command may throw: the others are obeyed later
    const display::ConsoleCommand command = std::move(commands_.front());
    commands_.pop_front();
    obey(command);
  }
  check_sound();
  check_screen();
  check_device();
  if (!monitor_.in_trial() || monitor_.asking()) respondent_.look_at_buttons(forces_.newest());
  if (!station_.screen.open())
    throw EndOfSession(data::RunEnd::aborted, "the participant's screen was closed", true);
  if (std::string trouble = station_.screen.trouble(); trouble != shown_trouble_) {
    shown_trouble_ = std::move(trouble);
    if (!shown_trouble_.empty()) {
      say(shown_trouble_);
      const nlohmann::ordered_json event = {{"input_trouble", shown_trouble_}};
      station_.record.note(station_.clock.now_ns(), event.dump());
    }
  }
  monitor_.show_if_due();
  forces_.end_without_guard();
}

void LiveSession::check_sound() {
  if (!sound_.has_failed()) return;
  hold_.pause();
  if (monitor_.in_trial()) throw participants::TrialCutOff("the sound stopped");
}

/// A participant who cannot see the keys, or sees the console, must not go on: the experimenter
/// decides.
void LiveSession::check_screen() {
  std::string now = station_.screen.misplaced();
  if (now == misplaced_) return;
  misplaced_ = std::move(now);
  if (misplaced_.empty()) {
    say("the windows are in their places again");
    return;
  }
  station_.record.note(station_.clock.now_ns(),
                       nlohmann::ordered_json{{"screen_trouble", misplaced_}}.dump());
  hold_.pause(misplaced_);
  say(misplaced_ + "; " + hold_.how_to_continue());
  if (monitor_.in_trial()) throw participants::TrialCutOff(misplaced_);
}

/// In a break there are no trials, so check here whether the device is gone.
void LiveSession::check_device() {
  if (monitor_.in_trial() || hold_.kind() >= SessionHold::Kind::transient_fault ||
      !forces_.device_is_gone())
    return;
  const servo::DeviceTrouble trouble = forces_.newest().trouble;
  const std::string reason = trip_reason(servo::servo_fault::kDeviceLost, trouble);
  hold_.hold(reason, false, trouble);
  say(reason + "; " + hold_.how_to_continue());
}

void LiveSession::obey(const display::ConsoleCommand& command) {
  using Kind = display::ConsoleCommand::Kind;
  const bool in_trial = monitor_.in_trial();
  switch (command.kind) {
    case Kind::pause:
      hold_.pause();
      say(in_trial ? "pause after this trial" : "paused");
      break;
    case Kind::resume:
      hold_.resume();
      break;
    case Kind::repeat_trial:
      if (in_trial) throw participants::TrialCutOff("repeated by the experimenter");
      say("no trial is under way");
      break;
    case Kind::stop_after_trial:
    case Kind::stop_after_block:
      plan_stop(command.kind);
      break;
    case Kind::emergency_zero:
      // While confidence is asked there are no trial ticks to show the stop.
      hold_.emergency_zero(command.text, in_trial && !monitor_.asking());
      note(command.time_ns, "emergency zero: " + command.text);
      say("EMERGENCY by " + command.text + ": forces are off until the fault is cleared");
      if (monitor_.asking())
        throw participants::TrialCutOff(
            trip_reason(servo::servo_fault::kEmergency, servo::DeviceTrouble::none));
      break;
    case Kind::clear_fault:
      if (in_trial) {
        say("there is no fault to clear");
      } else if (hold_.clear_fault()) {
        note(command.time_ns, "fault cleared");
        say("fault cleared; " + hold_.how_to_continue() + " when all are ready");
      }
      break;
    case Kind::note:
      note(command.time_ns, command.text);
      break;
    case Kind::answer:
      if (station_.answer_by != participants::AnswerBy::experimenter) {
        say("the participant answers; --spoken lets the experimenter do it");
      } else if (!respondent_.spoken(command.text, command.time_ns)) {
        say("'" + command.text +
            "' is not accepted: forces are off, or it is not a valid answer or out of range");
      }
      break;
    case Kind::correct:
      correct(command);
      break;
    case Kind::quit:
      throw end_by_experimenter(command.text);
  }
}

/// The answer before stays on record.
void LiveSession::correct(const display::ConsoleCommand& command) {
  const std::string& text = command.text;
  const std::size_t first = std::min(text.find(' '), text.size());
  const std::size_t second = std::min(text.find(' ', first + 1), text.size());
  const std::string page = text.substr(0, first);
  const std::string name = text.substr(std::min(first + 1, text.size()), second - first - 1);
  const std::string typed = second < text.size() ? text.substr(second + 1) : "";
  const std::vector<data::PageAnswer> answers = station_.record.answers();
  const auto before = std::find_if(answers.begin(), answers.end(), [&](const auto& one) {
    return one.page == page && one.item == name;
  });
  const protocols::PageItem* const item = item_of(station_.protocol, page, name);
  if (before == answers.end() || item == nullptr) {
    say("there is no answer of page '" + page + "' to question '" + name + "' to correct");
    return;
  }
  const std::optional<std::string> answer = participants::accepted_answer(*item, typed);
  if (!answer) {
    say("'" + typed + "' is not a valid answer to " + name + ", or out of range");
    return;
  }
  data::PageAnswer corrected = *before;
  corrected.answer = *answer;
  corrected.at_ns = command.time_ns;
  station_.record.answered(corrected);
  const nlohmann::ordered_json event = {
      {"answer_corrected", {{"page", page}, {"item", name}, {"by", "experimenter"}}}};
  station_.record.note(command.time_ns, event.dump());
  monitor_.show_answers();
  say("corrected: " + page + ", " + name + " (the answer before stays on record)");
}

void LiveSession::plan_stop(display::ConsoleCommand::Kind kind) {
  const Stop asked = kind == display::ConsoleCommand::Kind::stop_after_trial ? Stop::after_trial
                                                                             : Stop::after_block;
  if (stop_ == asked) {
    stop_ = Stop::no;
    monitor_.plan_stop("");
    say("the stop is cancelled: the session continues");
    return;
  }
  stop_ = asked;
  const std::string when = stop_ == Stop::after_trial ? "after this trial" : "after this block";
  monitor_.plan_stop(when);
  say("the session will stop " + when + " (" + station_.console.name_of(kind) +
      " again cancels it)");
}

void LiveSession::note(std::int64_t at_ns, const std::string& text) {
  try {
    station_.record.write_down(at_ns, text);
    say("note: " + text);
  } catch (const data::StoreRefused& refused) {  // empty, or invalid UTF-8
    say(refused.what());
  }
}

}  // namespace palpate::runner::session
