#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>

#include "runner/servo/device.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::testing {

/// The commands to a device and their times, by the machine's clock; for memory shared with its
/// process.
struct DeviceRecord {
  struct Write {
    std::int64_t time_ns = 0;
    double force = 0;  ///< N, size
  };
  static constexpr std::uint32_t kRoom = 1 << 16;

  void add(double force) {
    const std::uint32_t at = count.load();
    if (at >= kRoom) return;
    writes[at] = {servo::RealClock().now_ns(), force};
    count.store(at + 1);
  }
  double last_force() const {
    const std::uint32_t n = count;
    return n > 0 ? writes[n - 1].force : 0;
  }

  std::atomic<std::uint32_t> count{0};
  std::atomic<bool> closed{false};
  std::array<Write, kRoom> writes{};
};

/// Stays at a given pose and records every command.
class RecordingDevice final : public servo::Device {
 public:
  RecordingDevice(DeviceRecord& record, servo::DeviceReading (*where)(int tick))
      : record_(record), where_(where) {
    capabilities_ = {"recording", 5, 5, 8, 3000, 10000, 0.2, 0, true, "R-1", "never"};
  }
  ~RecordingDevice() override { record_.closed = true; }
  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override { return where_(tick_++); }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    const Vec3 sum = device1 + device2;
    record_.add(std::sqrt(sum.x * sum.x + sum.y * sum.y + sum.z * sum.z));
  }

 private:
  DeviceRecord& record_;
  servo::DeviceReading (*where_)(int);
  servo::DeviceCapabilities capabilities_;
  int tick_ = 0;
};

}  // namespace palpate::runner::testing
