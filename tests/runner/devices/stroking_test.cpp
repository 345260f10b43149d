// The open-loop hand of `run --device simulated`: a rest outside, a stroke to the centre and back
// as a raised cosine, again and again.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "runner/devices/simulated.h"

namespace palpate::runner::devices {
namespace {
namespace stroking {

constexpr double kLength = 0.13, kGrip = 0.05, kRate = 1000;

/// Place of the hand, m, at a time in s since its first rest began.
double wanted_y(const StrokeSettings& s, double time) {
  const double within = std::fmod(time, s.rest + s.stroke);
  if (within < s.rest) return -s.distance;
  const double fraction = (within - s.rest) / s.stroke;
  return -s.distance * 0.5 * (1 + std::cos(2 * M_PI * fraction));
}

void expect_strokes(StrokingStylus& device, const StrokeSettings& settings) {
  double furthest = -1;
  const int ticks = static_cast<int>(kRate * 2.2 * (settings.rest + settings.stroke));
  for (int tick = 1; tick <= ticks; ++tick) {
    const servo::DeviceReading reading = device.read();
    device.write(Vec3(0), Vec3(0));
    const double time = tick / kRate;
    EXPECT_FALSE(reading.lost);
    EXPECT_EQ(reading.buttons, 0);
    ASSERT_NEAR(reading.stylus.tip.x, 0, 1e-4);
    ASSERT_NEAR(reading.stylus.tip.y, wanted_y(settings, time), 2e-3) << time;
    ASSERT_NEAR(reading.stylus.tip.z, 0, 1e-4) << "the tip passes through the centre";
    ASSERT_NEAR(glm::length(reading.stylus.tail - reading.stylus.tip), kLength, 1e-4);
    ASSERT_GT(reading.stylus.tail.z, 0.12) << "upright";
    furthest = std::max(furthest, reading.stylus.tip.y);
  }
  EXPECT_NEAR(furthest, 0, 1e-3);
}

TEST(StrokingStylus, RestsThenStrokesToTheCentreAndBack) {
  StrokingStylus usual(kLength, kGrip, kRate);
  expect_strokes(usual, {0.1, 1.0, 1.5});
  const StrokeSettings other{0.06, 0.3, 0.8};
  StrokingStylus own(kLength, kGrip, kRate, other);
  expect_strokes(own, other);
}

TEST(StrokingStylus, RepeatsTheSameStrokeTickByTick) {
  const StrokeSettings settings{0.08, 0.2, 0.4};
  StrokingStylus device(kLength, kGrip, 500, settings);
  std::vector<double> ys;
  for (int tick = 0; tick < 900; ++tick) ys.push_back(device.read().stylus.tip.y);
  for (std::size_t i = 300; i + 300 < ys.size(); ++i) ASSERT_NEAR(ys[i], ys[i + 300], 1e-4) << i;
}

TEST(StrokingStylus, YieldsToAForceLikeAHand) {
  StrokingStylus device(kLength, kGrip, kRate, {0.1, 10, 1});
  for (int tick = 0; tick < 2000; ++tick) {
    device.write(Vec3(0, -1, 0), Vec3(0, -1, 0));
    device.read();
  }
  const Vec3 middle = device.read().stylus.tip +
                      kGrip / kLength * (device.read().stylus.tail - device.read().stylus.tip);
  EXPECT_NEAR(middle.y, -0.1 - 2 / HandImpedance().stiffness, 1e-3);
}

}  // namespace stroking
}  // namespace
}  // namespace palpate::runner::devices
