#include "runner/serve/served_session.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "data/base/text.h"
#include "protocols/fault_list.h"
#include "protocols/tasks/block_order.h"
#include "runner/safety/fault_signals.h"
#include "runner/session/session_scenes.h"
#include "stimuli/shapes.h"

namespace palpate::runner::serve {
namespace {

using nlohmann::ordered_json;
using protocols::TaskBlock;
using protocols::TaskKind;

constexpr std::int64_t kSteadyWait_ns = 150'000'000;  // at the edge of the home zone
constexpr double kSecond = 1e-9;

ordered_json number_or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

/// A recorded trial, for a program that continues from it.
ordered_json short_json(const data::TrialRecord& record) {
  ordered_json out = {{"trial", record.trial},        {"block", record.block},
                      {"stimulus", record.shape},     {"renderer", record.renderer},
                      {"response", record.response},  {"correct", record.correct},
                      {"timed_out", record.timed_out}};
  if (record.task.level) out["level"] = *record.task.level;
  return out;
}

}  // namespace

std::string unserved(const protocols::Protocol& protocol) {
  for (const protocols::PageSpec& page : protocol.pages) {
    if (!page.items.empty() || page.kind == protocols::PageSpec::Kind::consent)
      return "page '" + page.name + "' has questions, which need palpate run";
  }
  if (const TaskBlock* const asks = protocols::block_that_asks(protocol))
    return "block '" + asks->name +
           "' asks a program for its levels, which needs palpate run --ask";
  for (const TaskBlock& block : protocol.blocks) {
    const std::string name = "block '" + block.name + "' ";
    if (block.confidence) return name + "asks for confidence, which needs palpate run";
    if (block.task == TaskKind::adjust) return name + "is an adjustment, which needs palpate run";
    if (block.reaching) return name + "asks for movements to targets, which need palpate run";
  }
  return "";
}

ServedSession::ServedSession(const Parts& parts)
    : parts_(parts),
      clock_(parts.station.clock),
      forces_(parts.servo, parts.guard, parts.station.clock),
      sound_(parts.station, [this](const std::string& trouble) { sound_trouble_ = trouble; }),
      signals_(parts.station, parts.markers, sound_, parts.record.participant().code,
               parts.record.session()),
      session_(parts.station, *this, this, largest_reach(parts.station)) {
  for (const data::TrialRecord& record : parts.stored) trials_.push_back(short_json(record));
  keep_state();
}

void ServedSession::keep_state() {
  const data::Participant& person = parts_.record.participant();
  ordered_json record = {{"participant", person.code},
                         {"number", person.enrolled_number},
                         {"session", parts_.record.session()},
                         {"protocol", parts_.station.protocol.name},
                         {"done", session_.plan().done()},
                         {"trials", session_.plan().size()},
                         {"next", next_trial()},
                         {"stored", trials_}};
  const std::lock_guard lock(mutex_);
  state_ = {{"scene", nullptr}, {"record", std::move(record)}};
}

nlohmann::json ServedSession::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::string ServedSession::picture() const {
  const std::lock_guard lock(mutex_);
  return picture_;
}

void ServedSession::draw(const protocols::Trial& trial) {
  std::vector<stimuli::ObjectSpec> objects;
  const protocols::Protocol& protocol = parts_.station.protocol;
  for (const protocols::Interval& interval : trial.intervals) {
    if (interval.stimulus >= 0) objects.push_back(session::shown_object(protocol, trial, interval));
  }
  std::string picture = parts_.picture(objects);
  const std::lock_guard lock(mutex_);
  picture_.swap(picture);
}

void ServedSession::tell(const std::string& name, std::int64_t t_ns, const ordered_json& more) {
  output_->tell(event(name, t_ns, more));
}

void ServedSession::refuse(const std::optional<Asked>& asked, const std::string& code,
                           const std::string& why) {
  if (asked) output_->reply(asked->client, refused(asked->message.id, {{code, why, ""}}));
}

/// The next trial; null after the last.
ordered_json ServedSession::next_trial() const {
  if (session_.plan().finished()) return {};
  const protocols::Trial& trial = session_.plan().next();
  const TaskBlock& block = session_.task_of(trial);
  ordered_json out = {{"trial", trial.trial}, {"block", trial.block}, {"practice", trial.practice}};
  const auto& stimuli = parts_.station.protocol.stimuli;
  const auto name = [&](int i) { return stimuli[static_cast<std::size_t>(i)].name; };
  if (!block.name.empty()) {
    out["task"] = to_string(block.task);
    out["block_name"] = block.name;
  }
  out["answers"] = ordered_json::array();
  for (const protocols::TaskAnswer& one : block.answers) out["answers"].push_back(one.name);
  if (block.task == TaskKind::external) {
    out["stimuli"] = ordered_json::array();
    for (const int i : block.stimuli) out["stimuli"].push_back(name(i));
    if (block.level) out["level_range"] = {*block.least, *block.most};
    if (block.intervals > 1) out["intervals"] = block.intervals;
    return out;
  }
  const Quat& q = trial.orientation;
  out["stimulus"] = name(trial.stimulus);
  out["renderer"] = protocols::to_string(trial.renderer);
  out["orientation_wxyz"] = {q.w, q.x, q.y, q.z};
  if (trial.level) out["level"] = *trial.level;
  if (trial.intervals.size() > 1) out["intervals"] = trial.intervals.size();
  return out;
}

ServedSession::Outcome ServedSession::run(ServeOutput& output,
                                          std::function<std::vector<ServeCommand>()> commands) {
  output_ = &output;
  source_ = std::move(commands);
  Outcome outcome;
  try {
    outcome = run_trials();
  } catch (const data::StoreError&) {
    forces_.off();
    throw;
  }
  sound_.stop();
  const std::int64_t now = clock_.now_ns();
  if (!outcome.reason.empty()) parts_.record.note(now, "ended: " + outcome.reason);
  parts_.record.note(
      now, servo::to_json_text(parts_.servo.health(), parts_.station.protocol.servo_rate));
  parts_.record.end(outcome.end, now);
  tell("over", now,
       {{"done", session_.plan().done()},
        {"trials", session_.plan().size()},
        {"reason", outcome.reason}});
  if (outcome.end == data::RunEnd::done) wait_for_the_end();
  return outcome;
}

ServedSession::Outcome ServedSession::run_trials() {
  while (session_.state() != session::Session::State::end) {
    try {
      session_.step();
    } catch (const session::SessionFault& fault) {
      in_trial_ = false;
      const bool was_silent = silent_.exchange(false);
      if (emergencies_.any())
        held(emergencies_.why());
      else if (was_silent)
        held({"client-silent", "the client was silent"});
      else
        held(why_off(fault.faults, fault.trouble));
      if (fault.trouble == servo::DeviceTrouble::guard_lost)
        return {data::RunEnd::aborted, fault.reason, true};
    } catch (const session::EndOfSession& end) {
      in_trial_ = false;
      if (session_.plan().finished()) break;
      return {end.end, end.what(), end.failed};
    }
    in_trial_ = in_trial_ && session_.state() == session::Session::State::response;
    keep_under_way();
    if (!stored_) continue;
    keep_state();
    ordered_json said = short_json(*stored_);
    said["response_time_s"] = stored_->response_time;
    said["first_contact_s"] = number_or_null(stored_->first_contact_time);
    said["zero_t_ns"] = stored_->onset_ns;
    said["t_ns"] = stored_->response_ns;
    said["ticks"] = stored_->ticks;
    said["missed_ticks"] = stored_->missed_ticks;
    said["max_force_n"] = stored_->max_force;
    said["faults"] = safety::fault_words(stored_->faults);
    said["next"] = next_trial();
    tell("stored", clock_.now_ns(), said);
    if (stored_->timed_out && !answer_) timed_out_ = said;
    if (answer_) said["stamped"] = stamped_by(answer_->message);
    if (answer_) output_->reply(answer_->client, accepted(answer_->message.id, said));
    answer_.reset();
    stored_.reset();
  }
  return {};
}

/// All trials are on record: keep reporting the state until the controller leaves.
void ServedSession::wait_for_the_end() {
  keep_state();
  while (controller_ != 0) {
    try {
      attend();
    } catch (const session::EndOfSession&) {
      return;
    }
    parts_.servo.bell().wait(session::kSessionNap_ns);
  }
}

bool ServedSession::emergency(std::uint64_t client) {
  const bool first = emergencies_.raise(client);  // before zero force is seen, with its reason
  forces_.off();
  return first;
}

MessageRefused ServedSession::forces_off() const {
  if (emergencies_.any()) return {emergencies_.why().code, emergencies_.why().words};
  return {"forces-off", "forces are off (" + held_by_->words + "): clear first"};
}

void ServedSession::held(const WhyOff& why) {
  held_by_ = why;
  sound_.stop();
  const Refusal off = forces_off().why().front();
  refuse(std::exchange(start_, {}), off.code, off.message);
  keep_under_way();
  refuse(std::exchange(answer_, {}), off.code, off.message);
  refuse(std::exchange(next_, {}), off.code, off.message);
  tell("forces_off", clock_.now_ns(), {{"code", why.code}, {"reason", why.words}});
}

/// \throws EndOfSession, TrialCutOff
void ServedSession::attend() {
  if (const int signal = parts_.end_requested())
    throw session::EndOfSession(data::RunEnd::paused, std::string("signal: ") + strsignal(signal));
  for (ServeCommand& command : source_()) commands_.push_back(std::move(command));
  while (!commands_.empty()) {  // one of them may throw: the others are obeyed later
    ServeCommand command = std::move(commands_.front());
    commands_.pop_front();
    if (command.left) {
      controller_ = 0;
      left();
      continue;
    }
    if (command.controls) controller_ = command.client;
    const Asked asked{command.client, std::move(command.message)};
    try {
      obey(asked);
    } catch (const MessageRefused& error) {
      output_->reply(asked.client, refused(asked.message.id, error.why()));
    }
  }
  forces_.newest();
  forces_.end_without_guard();
  if (sound_.has_failed() && in_trial_) throw participants::TrialCutOff(sound_trouble_);
}

void ServedSession::left() {
  start_.reset();
  answer_.reset();
  next_.reset();
  keep_under_way();
  if (in_trial_) throw participants::TrialCutOff("the controller has left");
}

void ServedSession::obey(const Asked& asked) {
  const Message& message = asked.message;
  switch (message.type) {
    case MessageType::start:
      return start(asked);
    case MessageType::next:
      return show_next(asked);
    case MessageType::answer:
      return answer(asked);
    case MessageType::stop:
      if (!in_trial_) {
        refuse(std::exchange(start_, {}), "stopped", "stopped before forces were on");
        keep_under_way();
        return output_->reply(asked.client, accepted(message.id));
      }
      stop_ = asked;
      // Any reason must do: the record refuses a NUL, but forces end here.
      throw participants::TrialCutOff(message.text.empty() ? "stopped by the program"
                                                           : printable(message.text));
    case MessageType::mark:
    case MessageType::note: {
      const std::int64_t now = clock_.now_ns();
      const bool mark = message.type == MessageType::mark;
      const ordered_json out = remark(message);
      try {
        parts_.record.note(now, mark ? ordered_json{{"mark", out}}.dump() : message.text);
      } catch (const data::StoreRefused& error) {
        throw MessageRefused("bad-message", error.what(), "/text");
      }
      tell(mark ? "mark" : "note", now, out);
      if (mark) signals_.mark(message.code, now);
      return output_->reply(asked.client, accepted(message.id, {{"t_ns", now}}));
    }
    case MessageType::clear:
      return clear(asked);
    default:
      throw MessageRefused("recorded",
                           "the protocol defines the scenes: load and set are for --scene only");
  }
}

void ServedSession::start(const Asked& asked) {
  if (session_.plan().finished()) throw MessageRefused("over", "the last trial is on record");
  if (in_trial_ || start_) throw MessageRefused("running", "a trial is under way");
  const servo::Sample& newest = forces_.newest();
  const bool tripped = (newest.faults & servo::servo_fault::kTripped) != 0;  // between two trials
  if (tripped && !held_by_ && !emergencies_.any()) held(why_off(newest.faults, newest.trouble));
  if (held_by_ || emergencies_.any()) throw forces_off();
  choice_of(asked.message, session_.plan().next());  // refuse a bad choice at once, even in a break
  start_ = asked;
  timed_out_.reset();
  keep_under_way();
}

/// \throws MessageRefused: it is not the trial that is due, or cannot be presented
std::optional<protocols::TrialChoice> ServedSession::choice_of(const Message& message,
                                                               const protocols::Trial& next) const {
  const auto refused_as = [](const char* place, const std::string& expected) {
    return MessageRefused("bad-trial", "expected " + expected, place);
  };
  if (message.trial && *message.trial != next.trial)
    throw refused_as("/trial", std::to_string(next.trial) + ", the trial that is due");
  const auto& stimuli = parts_.station.protocol.stimuli;
  const auto named = [&](int i) { return stimuli[static_cast<std::size_t>(i)].name; };
  const TaskBlock& block = session_.task_of(next);
  if (block.task != TaskKind::external) {
    const Wanted& wanted = message.wanted;
    if (!wanted.stimulus.empty() && wanted.stimulus != named(next.stimulus))
      throw refused_as("/stimulus", named(next.stimulus) + ", as the protocol has it");
    if (!wanted.renderer.empty() && wanted.renderer != protocols::to_string(next.renderer))
      throw refused_as("/renderer", std::string(protocols::to_string(next.renderer)) +
                                        ", as the protocol has it");
    if (wanted.level && wanted.level != next.level) throw refused_as("/level", "the protocol's");
    if (message.orientation)
      throw refused_as("/orientation_wxyz", "none: the protocol sets the orientations");
    if (!message.intervals.empty())
      throw refused_as("/intervals", "none: the protocol sets the intervals");
    return std::nullopt;
  }
  const auto count = static_cast<std::size_t>(block.intervals);
  if (message.intervals.size() != (count > 1 ? count : 0))
    throw refused_as("/intervals", count > 1
                                       ? std::to_string(count) + " intervals, as the block has"
                                       : "none: the block has one interval");
  protocols::TrialChoice choice;
  for (std::size_t i = 0; i < message.intervals.size(); ++i)
    choice.intervals.push_back(
        interval_of(message.intervals[i], protocols::child_pointer("/intervals", i), block));
  protocols::Interval judged;
  if (choice.intervals.empty()) {
    judged = interval_of(message.wanted, "", block);
  } else {
    const auto asked = std::ranges::find(choice.intervals, false, &protocols::Interval::standard);
    if (asked == choice.intervals.end())
      throw refused_as("/intervals", "one interval that is no standard");
    judged = *asked;
  }
  choice.stimulus = judged.stimulus;
  choice.renderer = judged.renderer;
  choice.level = judged.level;
  choice.orientation = message.orientation;
  return choice;
}

/// \param place  JSON pointer of `wanted` in the message. \throws MessageRefused: the block has
/// none such
protocols::Interval ServedSession::interval_of(const Wanted& wanted, const std::string& place,
                                               const TaskBlock& block) const {
  const auto refused_as = [&](const char* key, const std::string& expected) {
    return MessageRefused("bad-trial", "expected " + expected, place + key);
  };
  const auto& stimuli = parts_.station.protocol.stimuli;
  protocols::Interval out;
  const auto stimulus = std::ranges::find_if(block.stimuli, [&](int i) {
    return stimuli[static_cast<std::size_t>(i)].name == wanted.stimulus;
  });
  if (stimulus == block.stimuli.end() && (!wanted.stimulus.empty() || block.stimuli.size() > 1))
    throw refused_as("/stimulus", "a stimulus of the block");
  out.stimulus = stimulus == block.stimuli.end() ? block.stimuli.front() : *stimulus;
  const auto renderer = std::ranges::find_if(block.renderers, [&](protocols::RendererKind kind) {
    return protocols::to_string(kind) == wanted.renderer;
  });
  if (renderer == block.renderers.end() && (!wanted.renderer.empty() || block.renderers.size() > 1))
    throw refused_as("/renderer", "a renderer of the block");
  out.renderer = renderer == block.renderers.end() ? block.renderers.front() : *renderer;
  if (block.level.has_value() != wanted.level.has_value())
    throw refused_as("/level", block.level ? "a level" : "none: the block has no level");
  if (wanted.level && !(*wanted.level >= *block.least && *wanted.level <= *block.most))
    throw refused_as("/level", "a level from min to max of the block");
  out.level = wanted.level;
  out.standard = wanted.standard;
  return out;
}

participants::Answer ServedSession::answer_of(const Message& message) const {
  const TaskBlock& block = session_.task_of(trial_);
  participants::Answer out;
  if (message.correct && block.task != TaskKind::external)
    throw MessageRefused("bad-answer", "expected none: palpate judges the answer", "/correct");
  out.correct = message.correct;
  if (block.answers.empty()) {  // the answer is a number
    const char* const end = message.text.data() + message.text.size();
    const auto [rest, error] = std::from_chars(message.text.data(), end, out.number);
    const bool within =
        !(block.least && out.number < *block.least) && !(block.most && out.number > *block.most);
    if (error != std::errc() || rest != end || !std::isfinite(out.number) || !within)
      throw MessageRefused("bad-answer", "expected a number within the block's range", "/response");
    return out;
  }
  const auto found = std::ranges::find(block.answers, message.text, &protocols::TaskAnswer::name);
  if (found == block.answers.end()) {
    std::string words;
    for (const protocols::TaskAnswer& one : block.answers)
      words += (words.empty() ? "" : ", ") + one.name;
    throw MessageRefused("bad-answer", "expected one of " + words, "/response");
  }
  out.stimulus = static_cast<int>(found - block.answers.begin());
  return out;
}

void ServedSession::show_next(const Asked& asked) {
  if (!in_trial_ || !begun_ || goes_on_)
    throw MessageRefused("nothing-felt", "no interval is felt that another one follows");
  if (view_.answers) throw MessageRefused("last-interval", "the trial has no more intervals");
  goes_on_ = true;
  next_ = asked;
}

void ServedSession::answer(const Asked& asked) {
  if (!in_trial_ && timed_out_) {
    const Refusal late{"timed-out", "the time for the answer was over: the trial is on record", ""};
    const ordered_json more = {{"stored", *timed_out_}, {"next", (*timed_out_)["next"]}};
    return output_->reply(asked.client, refused(asked.message.id, {late}, more));
  }
  if (!in_trial_ || !begun_)
    throw MessageRefused("nothing-felt",
                         in_trial_ ? "forces are not on yet" : "no trial is running: start first");
  if (!view_.answers)
    throw MessageRefused("not-yet", "interval " + std::to_string(view_.interval) + " of " +
                                        std::to_string(view_.intervals) +
                                        ": the answer comes after the last");
  if (given_) throw MessageRefused("answered", "the trial is answered");
  participants::Answer given = answer_of(asked.message);
  const std::int64_t now = clock_.now_ns();
  given.time_ns = answer_time(asked.message, now);
  if (given.time_ns < onset_ns_ || given.time_ns > now)
    throw MessageRefused("bad-message", "expected a time of this trial, CLOCK_MONOTONIC in ns",
                         "/t_ns");
  if (asked.message.t_ns) {
    const ordered_json stamped = {{"answer_time",
                                   {{"stamped", stamped_by(asked.message)},
                                    {"trial", trial_.trial},
                                    {"t_ns", *asked.message.t_ns},
                                    {"arrived_ns", now}}}};
    parts_.record.note(now, stamped.dump());
  }
  given_ = given;
  answer_ = asked;
}

void ServedSession::clear(const Asked& asked) {
  if (in_trial_) throw MessageRefused("running", "a trial is under way");
  const std::set<std::uint64_t> lifted = emergencies_.lift(asked.client);
  const std::string trouble =
      forces_.allow([this] { return parts_.end_requested() != 0; }, asked.message.times_off);
  if (!trouble.empty()) {
    emergencies_.restore(lifted);
    throw MessageRefused(emergencies_.any() ? emergencies_.why().code : "forces-off", trouble);
  }
  held_by_.reset();
  silent_.store(false);
  tell("cleared", clock_.now_ns());
  output_->reply(asked.client, accepted(asked.message.id));
}

void ServedSession::read(const std::string& text) {
  sound_.stop();
  if (!text.empty()) tell("text", clock_.now_ns(), {{"text", text}});
}

void ServedSession::rest(const std::string& text, std::int64_t until_ns) {
  sound_.stop();
  tell("rest", clock_.now_ns(), {{"text", text}, {"until_ns", until_ns}});
  while (clock_.now_ns() < until_ns) {
    attend();
    parts_.servo.bell().wait(std::min(until_ns - clock_.now_ns(), session::kSessionNap_ns));
  }
}

void ServedSession::feedback(bool correct) {
  sound_.cue(correct ? participants::SoundCue::right : participants::SoundCue::wrong);
}

/// Waits for `start` in every block.
std::optional<protocols::TrialChoice> ServedSession::choose(const protocols::Trial& next) {
  while (true) {
    attend();
    try {
      if (start_) {
        std::optional<protocols::TrialChoice> choice = choice_of(start_->message, next);
        if (!sound_.start()) throw MessageRefused("no-sound", sound_trouble_);
        return choice;
      }
    } catch (const MessageRefused& error) {  // practice may have continued with another trial
      output_->reply(start_->client, refused(start_->message.id, error.why()));
      start_.reset();
      keep_under_way();
    }
    parts_.servo.bell().wait(session::kSessionNap_ns);
  }
}

void ServedSession::begin_trial(const protocols::Trial& trial) {
  in_trial_ = true;
  trial_ = trial;
  onset_ns_ = 0;
  view_ = {};
  begun_ = goes_on_ = false;
  draw(trial);
  given_.reset();
  waits_for_ = servo::Waiting::nothing;
  parts_.servo.bell().ring();  // a client waits for forces
}

void ServedSession::begin_interval(const protocols::Trial&,
                                   const participants::IntervalView& view) {
  signals_.interval(view.continues);
  view_ = view;
  begun_ = goes_on_ = false;
  waits_for_ = servo::Waiting::nothing;
}

/// The first tick of an interval, or of the question after the last.
void ServedSession::begin_feeling(const servo::Sample& sample) {
  begun_ = true;
  if (view_.felt) onset_ns_ = sample.time_ns;
  const ordered_json trial = {{"trial", trial_.trial}};
  if (view_.interval == 1 && view_.felt) {
    ordered_json reply = {{"t_ns", onset_ns_}};
    reply.update(trial);
    if (start_) output_->reply(start_->client, accepted(start_->message.id, reply));
    start_.reset();
    return tell("started", onset_ns_, trial);
  }
  ordered_json more = trial;
  if (view_.felt) more["interval"] = view_.interval;
  tell(view_.felt ? "interval" : "question", sample.time_ns, more);
  if (!next_) return;
  more["t_ns"] = sample.time_ns;
  output_->reply(next_->client, accepted(next_->message.id, more));
  next_.reset();
}

std::optional<participants::Answer> ServedSession::step(const servo::Sample& sample) {
  ticks_.push(sample);
  if (sample.phase == servo::Phase::feeling && !begun_) begin_feeling(sample);
  if (!begun_ && sample.waiting != waits_for_ &&
      sample.time_ns - waits_since_ns_ > kSteadyWait_ns) {
    waits_for_ = sample.waiting;
    waits_since_ns_ = sample.time_ns;
    const bool far = sample.waiting == servo::Waiting::for_distance;
    if (sample.waiting == servo::Waiting::for_rest) sound_.cue(participants::SoundCue::ready);
    tell("waiting", sample.time_ns, {{"for", far ? "distance" : "rest"}});
  }
  attend();
  // A client waits for the next tick: take it when it comes, without a nap.
  if (given_ || goes_on_ || (start_ && sample.waiting == servo::Waiting::nothing))
    parts_.servo.bell().ring();
  if (given_ && sample.time_ns >= given_->time_ns) return given_;
  if (goes_on_ && begun_) {
    participants::Answer on;
    on.time_ns = sample.time_ns;
    on.continues = true;
    return on;
  }
  return std::nullopt;
}

void ServedSession::onset(const data::TrialRecord& so_far) { signals_.onset(so_far); }

void ServedSession::first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) {
  signals_.first_contact(time_ns);
  tell("first_contact", time_ns, {{"trial", so_far.trial}});
}

void ServedSession::cut_off(const std::string& reason) {
  in_trial_ = false;
  signals_.cut_off();
  const std::int64_t now = clock_.now_ns();
  tell("cut_off", now, {{"trial", trial_.trial}, {"reason", reason}});
  if (stop_) output_->reply(stop_->client, accepted(stop_->message.id, {{"t_ns", now}}));
  stop_.reset();
  refuse(std::exchange(start_, {}), "stopped", "the trial was cut off: " + reason);
  keep_under_way();
  if (answer_ && !held_by_)
    refuse(std::exchange(answer_, {}), "stopped", "the trial was cut off: " + reason);
  if (!held_by_) refuse(std::exchange(next_, {}), "stopped", "the trial was cut off: " + reason);
}

void ServedSession::recorded(const data::TrialRecord& record) {
  stored_ = record;
  stored_->samples.clear();
  stored_->bodies.clear();
  trials_.push_back(short_json(record));
}

}  // namespace palpate::runner::serve
