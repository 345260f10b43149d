#include "runner/session/live_session.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "protocols/tasks/levels.h"
#include "runner/session/session_plan.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
namespace {

constexpr double kSecond_ns = 1e9;
constexpr std::int64_t kFrame_ns = 33'000'000;  // of the console
constexpr std::size_t kMostMessages = 200;

/// For the console; null: keep the text on show.
const char* in_words(Session::State state) {
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
      return nullptr;
    case Session::State::end:
      return "end";
  }
  return "";
}

/// Whether answers judge the stimulus; a standard is felt only.
bool is_asked_for(const protocols::Protocol& protocol, int stimulus) {
  return protocol.blocks.empty() ||
         std::ranges::any_of(protocol.blocks, [&](const protocols::TaskBlock& block) {
           return std::ranges::find(block.stimuli, stimulus) != block.stimuli.end();
         });
}

bool has_right_answers(const protocols::TaskBlock& block) {
  return block.task != protocols::TaskKind::rate && block.task != protocols::TaskKind::adjust;
}

std::string milliseconds(std::int64_t ns) {
  return std::to_string((ns + 500'000) / 1'000'000) + " ms";
}

}  // namespace

SessionMonitor::SessionMonitor(const LiveStation& station, const Sources& sources)
    : station_(station), sources_(sources), started_ns_(station.clock.now_ns()) {
  state_.study = station.protocol.name;
  state_.tool = tool_of(station.protocol.tool);
  state_.participant = station.record.participant().code;
  state_.session = station.record.session();
  for (std::size_t i = 0; i < station.protocol.stimuli.size(); ++i) {
    if (is_asked_for(station.protocol, static_cast<int>(i)))
      state_.scores.push_back({station.protocol.stimuli[i].name, 0, 0});
  }
  state_.counts_right = station.protocol.blocks.empty() ||
                        std::ranges::any_of(station.protocol.blocks, has_right_answers);
  state_.takes_answers = station.answer_by == participants::AnswerBy::experimenter;
  show_answers();
}

void SessionMonitor::show_answers() {
  state_.given.clear();
  for (data::PageAnswer& one : station_.record.answers()) {
    const bool consent = std::any_of(
        station_.protocol.pages.begin(), station_.protocol.pages.end(), [&](const auto& page) {
          return page.name == one.page && page.kind == protocols::PageSpec::Kind::consent;
        });
    if (!consent) state_.given.push_back({one.page, one.item, std::move(one.answer)});
  }
}

double SessionMonitor::elapsed() const {
  return static_cast<double>(station_.clock.now_ns() - started_ns_) / kSecond_ns;
}

void SessionMonitor::say(const std::string& message) {
  if (state_.messages.size() >= kMostMessages) {
    state_.messages.erase(state_.messages.begin());
    ++state_.older_messages;
  }
  state_.messages.push_back(message);
  show();
}

void SessionMonitor::show() {
  shown_ns_ = station_.clock.now_ns();
  const Session& session = sources_.session;
  const SessionPlan& plan = session.plan();
  state_.seconds_left = sources_.respondent.seconds_left();
  state_.elapsed = static_cast<double>(shown_ns_ - started_ns_) / kSecond_ns;
  const std::size_t expected = expected_trials();
  state_.trials = static_cast<int>(expected);
  state_.about = expected != plan.size();
  if (state_.trial == 0 && plan.done() > 0) {  // resumed, and no trial has begun yet
    state_.trial = static_cast<int>(plan.done());
    if (!plan.finished()) state_.block = plan.next().block;
  }
  state_.pauses = in_trial_ && sources_.hold.kind() == SessionHold::Kind::pause;
  state_.blocks = plan.blocks();
  state_.remaining = seconds_per_trial_ * static_cast<double>(expected - plan.done());
  state_.sample = sources_.forces.newest();
  state_.bodies.clear();
  if (feeling_) {
    const auto bodies = station_.servo.bodies();
    state_.bodies.assign(bodies.begin(), bodies.end());
  }
  state_.fault = sources_.hold.fault();
  if (in_trial_) {
    state_.state = feeling_ ? "trial" : "homing";
  } else if (state_.held_by.empty() && !page_.empty()) {
    state_.state = page_;
  } else if (state_.held_by.empty() && in_words(session.state()) != nullptr) {
    state_.state = in_words(session.state());
  }
  const servo::ServoHealth& health = station_.servo_thread.health();
  state_.ticks = health.ticks();
  state_.missed_ticks = health.missed_ticks();
  state_.longest_period_ns = health.longest_period_ns();
  station_.console.show(state_);
}

std::size_t SessionMonitor::expected_trials() {
  const SessionPlan& plan = sources_.session.plan();
  if (expected_at_ != plan.done()) {
    expected_at_ = plan.done();
    expected_ = plan.expected_size();
  }
  return expected_;
}

void SessionMonitor::show_if_due() {
  if (station_.clock.now_ns() - shown_ns_ >= kFrame_ns) show();
}

void SessionMonitor::held() {
  state_.state = sources_.hold.state();
  state_.held_by = sources_.hold.held_by();
}

void SessionMonitor::count(const data::TrialRecord& record) {
  if (record.practice) return;
  for (display::ShapeScore& score : state_.scores) {
    if (score.shape != record.shape) continue;
    score.answered += record.timed_out ? 0 : 1;
    if (!data::has_right_answer(record)) continue;
    ++score.shown;
    score.right += record.correct ? 1 : 0;
  }
}

void SessionMonitor::interval(const protocols::Trial& trial,
                              const participants::IntervalView& view) {
  const auto& block = *protocols::block_of(station_.protocol, trial);
  sources_.signals.interval(view.continues);
  feeling_ = feeling_ && view.continues;
  state_.task = to_string(block.task);
  state_.counts_right = has_right_answers(block);
  state_.level_name = block.level ? protocols::level_name(block.level->pointer) : "";
  state_.interval = view.interval;
  state_.intervals = view.intervals;
  state_.level.clear();
  const protocols::Interval* const shown = view.shown;
  std::vector<stimuli::ObjectSpec> objects;
  if (shown != nullptr) {
    state_.renderer = protocols::to_string(shown->renderer);
    if (shown->stimulus >= 0) objects.push_back(shown_object(station_.protocol, trial, *shown));
    std::optional<double> level = shown->level;
    if (!level && block.level && shown->stimulus >= 0)
      level = protocols::own_level(station_.protocol, block, shown->stimulus);
    if (level) state_.level = protocols::level_in_words(block, *level);
  }
  state_.objects = std::make_shared<const std::vector<stimuli::ObjectSpec>>(std::move(objects));
  show();
}

void SessionMonitor::page(const PageView& view) {
  page_ = view.page.empty() ? ""
          : view.number == 0
              ? "page: " + view.page
              : "question " + std::to_string(view.number) + " of " +
                    std::to_string(view.questions) + ": " + view.page + ", " + view.question;
  show_answers();
  show();
}

void SessionMonitor::began(const protocols::Trial& trial) {
  const protocols::StimulusSpec& stimulus =
      station_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)];
  in_trial_ = true;
  feeling_ = touched_ = false;
  trial_began_ns_ = station_.clock.now_ns();
  stimuli::ObjectSpec object = stimulus.object;
  object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  state_.objects = std::make_shared<const std::vector<stimuli::ObjectSpec>>(1, std::move(object));
  state_.shape = stimulus.name;
  state_.practice = trial.practice;
  state_.renderer = protocols::to_string(trial.renderer);
  state_.block = trial.block;
  state_.trial = trial.trial;
  sources_.signals.began(trial);
  show();
}

void SessionMonitor::onset(const data::TrialRecord& so_far) {
  feeling_ = true;
  sources_.signals.onset(so_far);
}

void SessionMonitor::first_contact(const data::TrialRecord&, std::int64_t time_ns) {
  touched_ = true;
  sources_.signals.first_contact(time_ns);
}

void SessionMonitor::unrated(const data::TrialRecord& so_far) {
  const nlohmann::ordered_json event = {{"answered_before_confidence",
                                         {{"trial", so_far.trial},
                                          {"attempt", so_far.attempt},
                                          {"response", so_far.response},
                                          {"response_ns", so_far.response_ns}}}};
  station_.record.note(so_far.response_ns, event.dump());
}

void SessionMonitor::answered(const data::TrialRecord& record) {
  in_trial_ = asking_ = false;
  sources_.signals.answered(record);
}

void SessionMonitor::cut_off(const std::string& reason) {
  in_trial_ = asking_ = false;
  sources_.signals.cut_off();
  say("trial " + std::to_string(state_.trial) + " was cut off: " + reason);
}

/// For the experimenter; the record has every digit of an adjusted level.
std::string SessionMonitor::answer_in_words(const data::TrialRecord& record) const {
  if (!record.task.number || record.task.task != to_string(protocols::TaskKind::adjust))
    return record.response;
  const auto& blocks = station_.protocol.blocks;
  const auto block = std::find_if(
      blocks.begin(), blocks.end(),
      [&](const protocols::TaskBlock& one) { return one.name == record.task.block_name; });
  return block == blocks.end() ? record.response
                               : protocols::level_in_words(*block, *record.task.number);
}

void SessionMonitor::recorded(const data::TrialRecord& record) {
  state_.answer = record.timed_out ? "none in time" : answer_in_words(record);
  if (!record.timed_out && data::has_right_answer(record))
    state_.answer += record.correct ? ", right" : ", wrong";
  if (record.task.confidence)
    state_.answer += "; sure: " + protocols::level_text(*record.task.confidence);
  count(record);
  state_.times.push_back(record.response_time);
  const double took = static_cast<double>(station_.clock.now_ns() - trial_began_ns_) / kSecond_ns;
  ++timed_trials_;
  seconds_per_trial_ += (took - seconds_per_trial_) / timed_trials_;
  // A device with motors would have cut the trial off.
  if ((record.faults & servo::servo_fault::kMissedTicks) != 0)
    say("trial " + std::to_string(record.trial) + " missed " + std::to_string(record.missed_ticks) +
        (record.missed_ticks == 1 ? " tick, up to " : " ticks, up to ") +
        milliseconds(record.longest_period_ns) + " apart (recorded): the computer was busy");
  if (!record.response.empty() && !touched_ && !record.task.catch_trial) {
    say("trial " + std::to_string(record.trial) + " was answered before the first contact");
  }
}

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
      noise_(station, station.noise, [this](const std::string& message) { say(message); }),
      signals_(station, station.markers, noise_, station.record.participant().code,
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
  noise_.stop();
  RunRecord& record = station_.record;
  if (outcome.end == data::RunEnd::withdrawn) record.begin();  // at any time
  const std::int64_t now = station_.clock.now_ns();
  for (const std::string& text : record.pending_notes()) {
    if (text.front() != '{') outcome.unkept.push_back(text);
  }
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
      noise_.stop();
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
  if (now != Session::State::trial) noise_.stop();  // a page to read, and perhaps to discuss
  bool ready = false;
  while (!ready) {
    wait_while_held();
    ready = now != Session::State::trial || noise_.start();
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
  noise_.stop();
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
  check_noise();
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

void LiveSession::check_noise() {
  if (!noise_.has_failed()) return;
  hold_.pause();
  if (monitor_.in_trial()) throw participants::TrialCutOff("the masking noise stopped");
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
    case Kind::go_on:
      hold_.go_on();
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
    station_.record.note(at_ns, text);
    say(station_.record.confirmed(text));
  } catch (const data::StoreRefused& refused) {  // empty, or invalid UTF-8
    say(refused.what());
  }
}

}  // namespace palpate::runner::session
