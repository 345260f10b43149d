#include "tests/bench/unlogged_trial.h"

#include "data/files/utc.h"

namespace palpate::bench {
namespace {

constexpr double kSecond_ns = 1e9;

}  // namespace

void UnloggedTrial::run() {
  std::optional<runner::participants::Answer> answer;
  std::uint32_t faults = 0;
  while (!answer && !record_.timed_out && !(faults & runner::servo::servo_fault::kTripped)) {
    const runner::servo::Sample& sample = servo_.next();
    faults = sample.faults;
    if (sample.phase == runner::servo::Phase::feeling) {
      note(sample);
      contact_.add(sample);
      record_.timed_out = sample.time_ns - record_.onset_ns >= limit_ns_;
      record_.response_ns = sample.time_ns;
    }
    if (!record_.timed_out) answer = participant_.step(sample);
  }
}

void UnloggedTrial::note(const runner::servo::Sample& sample) {
  if (sample.tick == 0) {
    record_.onset_ns = sample.time_ns;
    record_.onset_utc = data::format_utc(sample.time_ns);
    record_.start_tip = {sample.probe.tip.x, sample.probe.tip.y, sample.probe.tip.z};
    record_.start_tail = {sample.probe.tail.x, sample.probe.tail.y, sample.probe.tail.z};
  }
  if (sample.rendering.contacts > 0 && !record_.first_contact_time) {
    record_.first_contact_time =
        static_cast<double>(sample.time_ns - record_.onset_ns) / kSecond_ns;
  }
}

}  // namespace palpate::bench
