// A second of readings compared with the limits of hand and device: both sides of each check's
// limit, and the messages.

#include "runner/devices/self_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace palpate::runner::devices {
namespace {
namespace self_testing {

constexpr int kRate = 200;  // Hz: as many readings
constexpr double kRadius = 0.2, kResolution = 1e-3;

/// A device of 200 Hz, run at a higher requested rate, that keeps the written forces.
class TestedDevice final : public servo::Device {
 public:
  explicit TestedDevice(std::function<servo::DeviceReading(int)> script)
      : script_(std::move(script)) {
    capabilities_.max_rate = kRate;
    capabilities_.workspace_radius = kRadius;
    capabilities_.resolution = kResolution;
  }
  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override { return script_(reads++); }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    ++writes;
    forces = forces || device1 != Vec3(0) || device2 != Vec3(0);
  }
  int reads = 0, writes = 0;
  bool forces = false;

 private:
  servo::DeviceCapabilities capabilities_;
  std::function<servo::DeviceReading(int)> script_;
};

servo::DeviceReading at(double x) { return {{Vec3(x, 0, 0), Vec3(x, 0, 0.12)}, 0, false}; }
servo::DeviceReading lost(servo::DeviceTrouble trouble) { return {{}, 0, true, trouble}; }

struct Line {
  std::string what;
  bool passed;
  std::string found;
  bool operator==(const Line&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Line& line) {
  return out << line.what << (line.passed ? " passed: " : " FAILED: ") << line.found;
}
std::vector<Line> lines_of(TestedDevice& device) {
  std::vector<Line> lines;
  for (const SelfTestResult& one : self_test(device, 4000))
    lines.push_back({one.what, one.passed, one.found});
  return lines;
}

TEST(SelfTest, ReadsForASecondAtTheDevicesOwnRateWithoutForce) {
  // 2 of 200 late, and each step and reach at its limit: a hand moves at 2 m/s, 10 mm at 200 Hz,
  // plus four times the resolution, here 1 mm.
  TestedDevice device([](int i) {
    servo::DeviceReading reading =
        at(i % 2 == 0 ? kRadius + 0.05 - 1e-9 : kRadius + 0.05 - 0.014 + 1e-9);
    if (i < 2) reading.trouble = servo::DeviceTrouble::late;
    return reading;
  });
  EXPECT_EQ(
      lines_of(device),
      (std::vector<Line>{{"readings arrive", true, "0 of 200 readings were lost"},
                         {"readings arrive in time", true, "2 of 200 were late"},
                         {"positions are finite", true, "0 of 200 were not"},
                         {"positions are within reach", true,
                          "up to 250.0 mm from the centre; it reaches 200.0 mm"},
                         {"positions do not jump", true,
                          "largest step 14.000 mm; a hand moves at most 10.0 mm a reading"}}));
  EXPECT_EQ(device.reads, kRate);
  EXPECT_EQ(device.writes, kRate);
  EXPECT_FALSE(device.forces);
}

TEST(SelfTest, EachFaultIsFoundAndReported) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  TestedDevice device([](int i) {
    if (i == 20) return lost(servo::DeviceTrouble::unplugged);
    if (i >= 40 && i < 43) {
      servo::DeviceReading reading = at(0);
      Vec3& end = i == 40 ? reading.stylus.tip : reading.stylus.tail;
      end[i - 40] = i == 41 ? HUGE_VAL : kNaN;
      return reading;
    }
    servo::DeviceReading reading = at(i < 100 ? 0.236 + 2e-6 : 0.25 + 4e-6);
    if (i >= 50 && i < 53) reading.trouble = servo::DeviceTrouble::late;
    return reading;
  });
  EXPECT_EQ(
      lines_of(device),
      (std::vector<Line>{{"readings arrive", false,
                          "1 of 200 readings were lost: the device is unplugged: plug it in again"},
                         {"readings arrive in time", false, "3 of 200 were late"},
                         {"positions are finite", false, "3 of 200 were not"},
                         {"positions are within reach", false,
                          "up to 250.0 mm from the centre; it reaches 200.0 mm"},
                         {"positions do not jump", false,
                          "largest step 14.002 mm; a hand moves at most 10.0 mm a reading"}}));
}

// Lost readings between two positions do not prove a jump.
TEST(SelfTest, ALostReadingIsNotCountedAsAJump) {
  TestedDevice device(
      [](int i) { return i == 100 ? lost(servo::DeviceTrouble::none) : at(i < 100 ? -0.1 : 0.1); });
  const std::vector<Line> lines = lines_of(device);
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0], (Line{"readings arrive", false, "1 of 200 readings were lost"}))
      << "no cause is named where none is known";
  EXPECT_EQ(lines[4], (Line{"positions do not jump", true,
                            "largest step 0.000 mm; a hand moves at most 10.0 mm a reading"}));
}

TEST(SelfTest, WithoutReadingsPositionsAreNotJudged) {
  TestedDevice device([](int i) {
    servo::DeviceReading reading = at(HUGE_VAL);
    return i < 100 ? lost(servo::DeviceTrouble::silent) : reading;
  });
  EXPECT_EQ(lines_of(device),
            (std::vector<Line>{{"readings arrive", false,
                                "100 of 200 readings were lost: the device gives no answer: check "
                                "its cable and its power supply"},
                               {"readings arrive in time", true, "0 of 200 were late"},
                               {"positions are finite", false, "100 of 200 were not"}}));
}

}  // namespace self_testing
}  // namespace
}  // namespace palpate::runner::devices
