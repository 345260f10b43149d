#pragma once
// A device that plays a recorded trial back to the servo.

#include <cstddef>
#include <cstdint>
#include <span>

#include "data/record.h"
#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::session {

/// A device that plays a recorded trial back to the servo: recorded poses at the recorded times.
/// Device and clock in one: each tick is one recorded period after the last. Its readings are in
/// the virtual frame, so the servo needs no workspace map. `samples` must outlive it. After the
/// last sample the device is lost.
class ReplayDevice final : public servo::Device, public servo::Clock {
 public:
  /// \param rate  Hz, for samples whose period is not on record
  ReplayDevice(std::span<const data::SampleRecord> samples, double rate);

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3&, const Vec3&) noexcept override {}  // forces are discarded

  std::int64_t now_ns() noexcept override { return now_ns_; }
  void wait_until(std::int64_t when_ns) noexcept override;

 private:
  std::span<const data::SampleRecord> samples_;
  std::size_t next_ = 0;
  std::int64_t nominal_ns_, now_ns_;
  servo::DeviceCapabilities capabilities_;
};

}  // namespace palpate::runner::session
