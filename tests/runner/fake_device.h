#pragma once

#include <functional>

#include "runner/servo/device.h"

namespace palpate::runner::testing {

/// Reads the value of a function of the tick, and keeps the last written forces.
class FakeDevice final : public servo::Device {
 public:
  /// \param drives  degrees of freedom
  explicit FakeDevice(std::function<servo::DeviceReading(int tick)> script, int drives = 5)
      : script_(std::move(script)) {
    capabilities_ = {"fake", 5, drives, 8, 3000, 1000, 0.2, 0, true};
  }
  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override { return script_(tick_++); }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    force = device1 + device2;
    last1 = device1;
    last2 = device2;
  }

  void drive_at_grip(double max_torque) { capabilities_.max_torque = max_torque; }
  void limit(double max_force) { capabilities_.max_force = max_force; }
  void take_motors_away() { capabilities_.actuated_freedom = 0; }

  Vec3 force, last1, last2;

 private:
  servo::DeviceCapabilities capabilities_;
  std::function<servo::DeviceReading(int)> script_;
  int tick_ = 0;
};

}  // namespace palpate::runner::testing
