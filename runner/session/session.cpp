#include "runner/session/session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/files/utc.h"
#include "runner/safety/fault_signals.h"
#include "runner/session/body_record.h"

namespace palpate::runner {
namespace {

constexpr double kPerSecond_ns = 1e9;

std::array<double, 3> values(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

bool SessionFault::is_transient() const {
  if (faults & (servo_fault::kEmergency | rendering::render_fault::kNonFinite)) return false;
  if (faults & servo_fault::kDeviceLost)
    return trouble == DeviceTrouble::guard_late || trouble == DeviceTrouble::guarded;
  return (faults & (servo_fault::kMissedTicks | servo_fault::kStalled)) != 0;
}

std::string trip_reason(std::uint32_t faults, DeviceTrouble trouble) {
  using namespace servo_fault;
  for (const std::uint32_t bit :
       {kEmergency, kStalled, kDeviceLost, kMissedTicks, rendering::render_fault::kNonFinite,
        rendering::render_fault::kSoftStalled}) {
    if ((faults & bit) == 0) continue;
    std::string why = bit == kDeviceLost ? advice(trouble) : "";
    if (trouble == DeviceTrouble::guard_late || trouble == DeviceTrouble::guarded) {
      if (!why.empty()) return why;
    }
    return fault_row(bit).why + (why.empty() ? why : ": " + why);
  }
  return fault_row(kTripped).why;
}

Session::Session(const Station& station, Respondent& participant, SessionEvents* events,
                 double least_reach)
    : station_(station), participant_(participant), events_(events), least_reach_(least_reach) {
  if (station.protocol.version == 1) return;
  scenes_ = std::make_unique<LevelScenes>(station.protocol);
  least_reach_ = std::max(least_reach, largest_reach(station));  // the same for every level
}

bool Session::ServoState::tripped() const { return (faults & servo_fault::kTripped) != 0; }

Session::State Session::before_trial() const {
  if (station_.plan.finished()) return State::end;
  if (station_.plan.block_begins())
    return station_.plan.next().practice ? State::practice : State::block;
  const auto& every = station_.protocol.breaks.every_trials;
  if (every && station_.plan.done_in_block() % static_cast<std::size_t>(*every) == 0)
    return State::rest;
  return State::trial;
}

void Session::step() {
  const auto& texts = station_.protocol.texts;
  switch (state_) {
    case State::instruction:
      state_ = before_trial();
      if (state_ == State::end) {  // interrupted behind the last trial
        show_pages(protocols::PageSpec::When::after);
        participant_.read(texts.end);
        break;
      }
      state_ = State::instruction;
      show_pages(protocols::PageSpec::When::before);
      participant_.read(texts.instructions);
      resume_task_block();
      state_ = before_trial();
      break;
    case State::practice:
      rest_between_blocks();
      participant_.read(texts.practice);
      begin_task_block();
      state_ = State::trial;
      break;
    case State::block:
      rest_between_blocks();
      begin_task_block();
      state_ = State::trial;
      break;
    case State::rest:
      rest();
      state_ = State::trial;
      break;
    case State::trial:
      if (run_trial()) state_ = State::response;
      break;
    case State::response:
      station_.log.finish(record_);
      if (events_ != nullptr) events_->recorded(record_);
      tell_level();
      tell_feedback();
      state_ = before_trial();
      if (state_ == State::end) {
        show_pages(protocols::PageSpec::When::after);
        participant_.read(texts.end);
      }
      break;
    case State::end:
      break;
  }
}

void Session::tell_feedback() {
  const bool feedback =
      record_.task
          ? station_.protocol.blocks[static_cast<std::size_t>(station_.plan.next().task_block)]
                .feedback
          : record_.practice || station_.protocol.response.feedback;
  station_.plan.answered(
      outcome_of(record_));  // first: whoever leaves during the feedback has answered
  if (feedback && data::has_right_answer(record_)) participant_.feedback(record_.correct);
}

data::TrialRecord Session::planned_record(const protocols::Trial& trial) const {
  data::TrialRecord record;
  record.session = trial.session;
  record.block = trial.block;
  record.trial = trial.trial;
  record.renderer = protocols::to_string(trial.renderer);
  record.shape = station_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
  record.practice = trial.practice;
  const Quat& q = trial.orientation;
  record.orientation_wxyz = {q.w, q.x, q.y, q.z};
  if (trial.task_block >= 0) plan_task(trial, record);
  return record;
}

/// Practice belongs to the block that follows: they are not taken apart.
void Session::rest_between_blocks() {
  if (station_.plan.done() > 0 && !station_.plan.after_practice()) rest();
}

void Session::rest() {
  const std::int64_t until =
      station_.clock.now_ns() + std::llround(station_.protocol.breaks.min_seconds * kPerSecond_ns);
  participant_.rest(station_.protocol.texts.break_text, until);
  station_.clock.wait_until(until);
}

void Session::cut_off(const std::string& reason) {
  if (events_ != nullptr) events_->cut_off(reason);
  station_.log.cut_off(reason);
}

std::optional<Answer> Session::show_stimulus(const protocols::Trial& trial, ServoState& servo) {
  contact_.begin(station_.library.edges(trial.stimulus), trial.orientation);
  const HomeZone home{std::max(station_.library.reach(trial.stimulus), least_reach_) +
                          station_.protocol.home.margin,
                      station_.protocol.home.rest};
  station_.servo.prepare(station_.library.scene(trial), renderer_for(trial.renderer), home);
  return wait_for_answer(servo);
}

std::optional<Answer> Session::wait_for_answer(ServoState& servo) {
  const std::int64_t limit_ns = std::llround(station_.protocol.response.time_out * kPerSecond_ns);
  while (true) {
    const Sample& sample = station_.servo.next();
    servo = {sample.faults, sample.trouble};
    if (servo.tripped()) return std::nullopt;
    if (sample.phase == Phase::feeling) {
      record_onset_and_contact(sample);
      contact_.add(sample);
      if (station_.protocol.samples) record_sample(sample);
      record_.response_ns = sample.time_ns;
    }
    const std::optional<Answer> answer = participant_.step(sample);
    if (answer && answer->time_ns - record_.onset_ns < limit_ns) return answer;
    record_.timed_out =
        sample.phase == Phase::feeling && sample.time_ns - record_.onset_ns >= limit_ns;
    if (record_.timed_out) return std::nullopt;
  }
}

bool Session::run_trial() {
  ask_level();
  if (const auto choice = participant_.choose(station_.plan.next())) station_.plan.choose(*choice);
  const protocols::Trial& trial = station_.plan.next();
  record_ = planned_record(trial);
  record_.attempt = station_.log.begin(record_, station_.clock.now_ns());
  quality_ = {};
  if (events_ != nullptr) events_->began(trial);
  std::optional<Answer> answer;
  ServoState servo;
  try {
    participant_.begin_trial(trial);
    answer = record_.task ? show_intervals(trial, servo) : show_stimulus(trial, servo);
  } catch (const TrialCutOff& again) {
    station_.servo.stop();
    cut_off(again.what());
    return false;
  } catch (const std::exception& error) {
    station_.servo.stop();
    cut_off(error.what());
    throw;
  }
  const ServoQuality last = station_.servo.stop();
  if (!record_.task) quality_ = last;  // intervals have been added one by one
  if (servo.tripped()) {
    const std::string reason = trip_reason(servo.faults, servo.trouble);
    cut_off(reason);
    throw SessionFault("forces are off: " + reason + "; trial " + std::to_string(record_.trial) +
                           " will be shown again",
                       reason, servo.faults, servo.trouble);
  }
  take_answer(trial, answer);
  record_.ticks = quality_.ticks;
  record_.missed_ticks = quality_.missed_ticks;
  record_.longest_period_ns = quality_.longest_period_ns;
  record_.faults = quality_.faults;
  record_.started_inside = (quality_.faults & rendering::render_fault::kStartedInside) != 0;
  record_.max_force = quality_.max_force;
  record_.contact_share = contact_.contact_share();
  record_.edge_dwell = contact_.edge_dwell(1 / station_.protocol.servo_rate);
  if (events_ != nullptr) events_->answered(record_);
  return true;
}

void Session::add_quality(const ServoQuality& quality) {
  quality_.ticks += quality.ticks;
  quality_.missed_ticks += quality.missed_ticks;
  quality_.longest_period_ns = std::max(quality_.longest_period_ns, quality.longest_period_ns);
  quality_.faults |= quality.faults;
  quality_.max_force = std::max(quality_.max_force, quality.max_force);
}

void Session::take_answer(const protocols::Trial& trial, const std::optional<Answer>& answer) {
  record_.response_time =
      record_.task ? task_of(trial).time_out : station_.protocol.response.time_out;
  if (answer) {
    record_.response_ns = answer->time_ns;
    record_.response_time =
        static_cast<double>(record_.response_ns - record_.onset_ns) / kPerSecond_ns;
  }
  if (record_.task) {
    take_task_answer(trial, answer);
  } else if (answer) {
    record_.response = station_.protocol.stimuli[static_cast<std::size_t>(answer->stimulus)].name;
    record_.correct = answer->stimulus == trial.stimulus;
  }
  // The answer may have come before the tick that was looked at last.
  if (record_.first_contact_time && *record_.first_contact_time > record_.response_time)
    record_.first_contact_time.reset();
}

void Session::record_onset_and_contact(const Sample& sample) {
  if (sample.tick == 0) {
    record_.onset_ns = sample.time_ns;
    record_.onset_utc = data::format_utc(data::to_unix_ns(station_.utc, sample.time_ns));
    record_.start_tip = values(sample.probe.tip);
    record_.start_tail = values(sample.probe.tail);
    if (events_ != nullptr) events_->onset(record_);
  }
  const rendering::Rendering& rendering = sample.rendering;
  if (rendering.contacts > 0 && !record_.first_contact_time) {
    record_.first_contact_time =
        static_cast<double>(sample.time_ns - record_.onset_ns) / kPerSecond_ns;
    if (events_ != nullptr) events_->first_contact(record_, sample.time_ns);
  }
}

void Session::record_sample(const Sample& sample) {
  const rendering::Rendering& rendering = sample.rendering;
  data::SampleRecord kept;
  kept.tick = sample.tick;
  kept.period_ns = sample.period_ns;
  kept.lateness_ns = sample.lateness_ns;
  kept.compute_ns = sample.compute_ns;
  kept.tip = values(sample.probe.tip);
  kept.tail = values(sample.probe.tail);
  kept.force = values(rendering.force);
  kept.torque = values(rendering.torque);
  kept.device1 = values(sample.device1);
  kept.device2 = values(sample.device2);
  kept.depth = rendering.deepest.depth;
  kept.contacts = recorded_contacts(rendering.contacts);
  kept.contact_type = static_cast<std::uint8_t>(rendering.deepest.type);
  kept.buttons = sample.buttons;
  kept.faults = sample.faults;
  const auto bodies = station_.servo.bodies();  // one at most: a stimulus is one object
  kept.bodies = bodies.empty() ? 0 : 1;
  record_.samples.push_back(kept);
  if (bodies.empty() && record_.bodies.empty()) return;
  record_.bodies.resize(record_.samples.size());  // with those of intervals without one
  if (!bodies.empty()) record_.bodies.back() = body_record(bodies.front());
}

}  // namespace palpate::runner
