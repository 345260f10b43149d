#pragma once
// A device of a maker whose library is a stub (stub_state.h): what the tests of such devices share.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

#include "runner/evidence/tick_meters.h"
#include "runner/servo/device.h"
#include "tests/runner/devices/forcedimension/stub_state.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::devices::testing {

/// One device with the serial number 4711, well and connected.
class StubbedDevice : public ::testing::Test {
 protected:
  using Open = std::unique_ptr<servo::Device> (*)(const servo::DeviceConfig& config);

  StubbedDevice(Open open, const char* library) : open_(open) {
    // The stub keeps the first file that it maps: each test rewrites the same file.
    static const palpate::testing::TemporaryFolder folder;
    static const std::string path = folder / "stub";
    setenv("PALPATE_STUB_STATE", path.c_str(), 1);
    static StubState* const mapped = map_stub_state(path);
    state_ = mapped;
    make_well();
    config_.library = library;
  }

  void make_well() {
    *state_ = StubState{};
    one().serial = 4711;
  }
  StubDevice& one() { return state_->device[0]; }
  StubDevice& other() { return state_->device[1]; }
  /// Why it cannot be opened; "": it can.
  std::string refusal() {
    try {
      open_(config_);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  static void expect_no_allocation(servo::Device& device) {
    if (!evidence::counts_allocations())
      GTEST_SKIP() << "allocations are not counted under sanitizers";
    constexpr int kMinuteOfTicks = 60'000;  // at 1 kHz
    const std::uint64_t before = evidence::allocations();
    for (int tick = 0; tick < kMinuteOfTicks; ++tick) {
      device.read();
      device.write({0, 0, 1}, Vec3(0));
    }
    EXPECT_EQ(evidence::allocations(), before);
  }

  StubState* state_;
  servo::DeviceConfig config_;

 private:
  Open open_;
};

}  // namespace palpate::runner::devices::testing
