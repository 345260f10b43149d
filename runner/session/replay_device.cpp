#include "runner/session/replay_device.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

namespace palpate::runner::session {
namespace {

Vec3 vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

ReplayDevice::ReplayDevice(std::span<const data::SampleRecord> samples, double rate)
    : samples_(samples), nominal_ns_(std::llround(1e9 / rate)), now_ns_(nominal_ns_) {
  capabilities_.name = "replay";
  capabilities_.sensed_freedom = capabilities_.actuated_freedom = 5;
  // Replay compares the rendered force, without the limits of the recorded device.
  capabilities_.max_force = capabilities_.max_stiffness = std::numeric_limits<double>::max();
  capabilities_.max_rate = rate;
}

servo::DeviceReading ReplayDevice::read() noexcept {
  servo::DeviceReading reading;
  if (next_ >= samples_.size()) {
    reading.lost = true;
    return reading;
  }
  const data::SampleRecord& sample = samples_[next_++];
  reading.stylus = {vec(sample.tip), vec(sample.tail)};
  reading.buttons = sample.buttons;
  return reading;
}

void ReplayDevice::wait_until(std::int64_t when_ns) noexcept {
  const bool known = next_ < samples_.size() && samples_[next_].period_ns > 0;
  // The period before the first tick of a trial is not on record.
  if (known && next_ > 0) {
    now_ns_ += samples_[next_].period_ns;
  } else {
    now_ns_ = when_ns > now_ns_ ? when_ns : now_ns_;
  }
}

}  // namespace palpate::runner::session
