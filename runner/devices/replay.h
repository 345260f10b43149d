#pragma once
// A recorded trial before the servo again: the stylus as it was, at the times that it was.

#include <span>

#include "data/record.h"
#include "runner/servo/device.h"

namespace palpate::runner {

/// The device and the clock of a recording in one: each tick comes a recorded period after the last
/// and finds the stylus where it then was. With its readings in the virtual frame: the servo needs
/// no workspace. `samples` must outlive it. After the last one the device is lost.
class ReplayDevice final : public Device, public Clock {
 public:
  /// \param rate  Hz, for samples whose period is not on record
  ReplayDevice(std::span<const data::SampleRecord> samples, double rate);

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceReading read() noexcept override;
  void write(const Vec3&, const Vec3&) noexcept override {}  // nobody holds it

  std::int64_t now_ns() noexcept override { return now_ns_; }
  void wait_until(std::int64_t when_ns) noexcept override;

 private:
  std::span<const data::SampleRecord> samples_;
  std::size_t next_ = 0;
  std::int64_t nominal_ns_, now_ns_;
  DeviceCapabilities capabilities_;
};

}  // namespace palpate::runner
