#include "runner/session.h"

#include <cmath>
#include <utility>

#include "data/utc.h"

namespace palpate {
namespace {

constexpr double kSecond_ns = 1e9;

std::array<double, 3> values(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

Session::Session(const Parts& parts, SessionPlan plan, const ClockStamp& stamp)
    : parts_(parts), plan_(std::move(plan)), stamp_(stamp) {}

Session::State Session::before_trial() const {
  if (plan_.finished()) return State::end;
  if (plan_.block_begins()) return plan_.next().practice ? State::practice : State::block;
  const auto& every = parts_.protocol.breaks.every_trials;
  if (every && plan_.done() % static_cast<std::size_t>(*every) == 0) return State::rest;
  return State::trial;
}

void Session::step() {
  const auto& texts = parts_.protocol.texts;
  switch (state_) {
    case State::instruction:
      parts_.participant.read(texts.instructions);
      state_ = before_trial();
      break;
    case State::practice:
      parts_.participant.read(texts.practice);
      state_ = State::trial;
      break;
    case State::block:
    case State::rest:
      if (plan_.done() > 0) {
        parts_.participant.read(texts.break_text);
        parts_.clock.wait_until(parts_.clock.now_ns() +
                                std::llround(parts_.protocol.breaks.min_seconds * kSecond_ns));
      }
      state_ = State::trial;
      break;
    case State::trial:
      run_trial();
      state_ = State::response;
      break;
    case State::response:
      parts_.log.finish(record_);
      if (record_.practice || parts_.protocol.response.feedback)
        parts_.participant.feedback(record_.correct);
      plan_.answered(record_.correct);
      state_ = before_trial();
      if (state_ == State::end) parts_.participant.read(texts.end);
      break;
    case State::end:
      break;
  }
}

TrialRecord Session::planned_record(const Trial& trial) const {
  TrialRecord record;
  record.session = trial.session;
  record.block = trial.block;
  record.trial = trial.trial;
  record.renderer = to_string(trial.renderer);
  record.shape = parts_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
  record.practice = trial.practice;
  const Quat& q = trial.orientation;
  record.orientation_wxyz = {q.w, q.x, q.y, q.z};
  return record;
}

void Session::run_trial() {
  const Trial& trial = plan_.next();
  const Protocol& protocol = parts_.protocol;
  record_ = planned_record(trial);
  record_.attempt = parts_.log.begin(record_, parts_.clock.now_ns());
  const HomeZone home{parts_.library.reach(trial.stimulus) + protocol.home.margin,
                      protocol.home.rest};
  parts_.participant.begin_trial(trial);
  parts_.servo.prepare(parts_.library.scene(trial), renderer_for(trial.renderer), home);
  const std::int64_t limit_ns = std::llround(protocol.response.time_out * kSecond_ns);
  std::optional<Answer> answer;
  std::uint32_t faults = 0;
  while (!answer && !record_.timed_out && !(faults & servo_fault::kTripped)) {
    const Sample& sample = parts_.servo.next();
    faults = sample.faults;
    if (sample.phase == Phase::feeling) {
      note(sample);
      if (protocol.samples) keep(sample);
      record_.timed_out = sample.time_ns - record_.onset_ns >= limit_ns;
      record_.response_ns = sample.time_ns;
    }
    if (!record_.timed_out) answer = parts_.participant.step(sample);
  }
  const ServoQuality quality = parts_.servo.stop();
  if (faults & servo_fault::kTripped) {
    const char* reason = faults & servo_fault::kDeviceLost ? "the device was lost"
                         : faults & servo_fault::kMissedTicks
                             ? "too many ticks were missed in a row"
                             : "a force or pose was not finite";
    parts_.log.cut_off(reason);
    throw SessionFault(std::string("forces are off: ") + reason + "; trial " +
                       std::to_string(record_.trial) + " will be shown again");
  }
  record_.response_time = protocol.response.time_out;
  if (answer) {
    record_.response_ns = answer->time_ns;
    record_.response_time =
        static_cast<double>(record_.response_ns - record_.onset_ns) / kSecond_ns;
    record_.response = protocol.stimuli[static_cast<std::size_t>(answer->stimulus)].name;
    record_.correct = answer->stimulus == trial.stimulus;
  }
  record_.ticks = quality.ticks;
  record_.missed_ticks = quality.missed_ticks;
  record_.longest_period_ns = quality.longest_period_ns;
  record_.faults = quality.faults;
  record_.started_inside = (quality.faults & render_fault::kStartedInside) != 0;
  record_.max_force = quality.max_force;
}

void Session::note(const Sample& sample) {
  if (sample.tick == 0) {
    record_.onset_ns = sample.time_ns;
    record_.onset_utc = format_utc(to_unix_ns(stamp_, sample.time_ns));
    record_.start_tip = values(sample.probe.tip);
    record_.start_tail = values(sample.probe.tail);
  }
  const Rendering& rendering = sample.rendering;
  if (rendering.contacts > 0 && !record_.first_contact_time) {
    record_.first_contact_time =
        static_cast<double>(sample.time_ns - record_.onset_ns) / kSecond_ns;
  }
}

void Session::keep(const Sample& sample) {
  const Rendering& rendering = sample.rendering;
  SampleRecord kept;
  kept.tick = sample.tick;
  kept.period_ns = sample.period_ns;
  kept.tip = values(sample.probe.tip);
  kept.tail = values(sample.probe.tail);
  kept.force = values(rendering.force);
  kept.torque = values(rendering.torque);
  kept.depth = rendering.deepest.depth;
  kept.contacts = static_cast<std::uint8_t>(rendering.contacts);
  kept.contact_type = static_cast<std::uint8_t>(rendering.deepest.type);
  kept.buttons = sample.buttons;
  kept.faults = static_cast<std::uint8_t>(sample.faults);
  record_.samples.push_back(kept);
}

}  // namespace palpate
