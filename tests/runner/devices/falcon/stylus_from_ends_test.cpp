#include "runner/devices/falcon/stylus_from_ends.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"

namespace palpate::runner::devices {
namespace {

Vec3 apply(const Pose& pose, const Vec3& p) { return pose.orientation * p + pose.position; }

std::vector<PairedPoint> paired(const Pose& truth, int count, double noise, std::uint64_t seed,
                                const Vec3& spread = Vec3(0.03)) {
  Random random(seed);
  const auto normal = [&random](double size) {
    return size * Vec3(random.normal(), random.normal(), random.normal());
  };
  std::vector<PairedPoint> points;
  for (int i = 0; i < count; ++i) {
    const Vec3 p = spread * normal(1);
    points.push_back({apply(truth, p) + normal(noise), p + normal(noise)});
  }
  return points;
}

TEST(StylusFromEnds, TheFitIsExactWithoutNoise) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int round = 0; round < 200; ++round) {
    const Pose truth{{0.3, -0.2, 0.1 * round}, stimuli::uniform_rotation(random)};
    const RigidFit fit = fit_rigid(paired(truth, 8 + round % 5, 0, 100 + round));
    EXPECT_LT(glm::length(fit.tail_in_tip.position - truth.position), 1e-12);
    EXPECT_GT(std::abs(glm::dot(fit.tail_in_tip.orientation, truth.orientation)), 1 - 1e-12);
    EXPECT_LT(fit.residual, 1e-12);
    EXPECT_LT(fit.worst, 1e-12);
  }
}

TEST(StylusFromEnds, NoiseGivesItsResidual) {
  const Pose truth{{0.1, 0.2, 0.3}, glm::normalize(Quat(1, 2, 3, 4))};
  const std::vector<PairedPoint> points = paired(truth, 200, 0.0005, 9);
  const RigidFit fit = fit_rigid(points);
  // Both ends err by 0.5 mm in each of three directions.
  EXPECT_NEAR(fit.residual, 0.0005 * std::sqrt(6.0), 1e-4);
  EXPECT_GT(fit.worst, fit.residual);
  double farthest = 0;
  for (const PairedPoint& point : points) {
    const Vec3 off = apply(fit.tail_in_tip, point.tail_frame) - point.tip_frame;
    farthest = std::max(farthest, glm::length(off));
  }
  EXPECT_NEAR(fit.worst, farthest, 1e-12);
  EXPECT_LT(glm::length(fit.tail_in_tip.position - truth.position), 3e-4);
}

TEST(StylusFromEnds, CoplanarPointsGiveNoReflection) {
  const Pose truth{{0.1, 0, 0}, glm::normalize(Quat(0, 1, 1, 0))};
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    auto points = paired(truth, 8, 0, seed);
    Random random(seed, {1});
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 p = 0.03 * Vec3(std::cos(i), std::sin(i), 0);
      points[i] = {apply(truth, p) + 3e-4 * Vec3(random.normal(), random.normal(), random.normal()),
                   p};
    }
    const RigidFit fit = fit_rigid(points);
    EXPECT_LT(glm::length(apply(fit.tail_in_tip, {0, 0, 0.03}) - apply(truth, {0, 0, 0.03})),
              0.003);
  }
}

TEST(StylusFromEnds, DegeneratePointsAreRefused) {
  const Pose truth{};
  EXPECT_THROW(fit_rigid(paired(truth, 3, 0, 1)), RegistrationError);
  EXPECT_THROW(fit_rigid(paired(truth, 8, 0, 1, Vec3(0.03, 0, 0))), RegistrationError);  // a line
  EXPECT_THROW(fit_rigid(paired(truth, 8, 0, 1, Vec3(0.001))), RegistrationError);       // a spot
  auto bad = paired(truth, 8, 0, 1);
  bad[3].tip_frame.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fit_rigid(bad), RegistrationError);
}

TEST(StylusFromEnds, ThePoseComesFromBothDevices) {
  const Pose registered{{0, 0, 0.12}, glm::normalize(Quat(1, 0, 0, 1))};
  StylusFromEnds stylus(registered, 0.12);
  EXPECT_TRUE(
      stylus.update({0.01, 0, 0}, glm::conjugate(registered.orientation) * Vec3(0.01, 0, 0)));
  EXPECT_LT(glm::length(stylus.stylus().tail - Vec3(0.01, 0, 0.12)), 1e-15);
  EXPECT_EQ(stylus.stylus().tip, Vec3(0.01, 0, 0));
  EXPECT_NEAR(stylus.stretch(), 0, 1e-15);
  // Work is the same in both frames.
  const Vec3 force(1, 2, 3);
  EXPECT_LT(glm::length(registered.orientation * stylus.to_tail_frame(force) - force), 1e-14);
}

TEST(StylusFromEnds, AStylusThatChangesItsLengthIsAFault) {
  StylusFromEnds stylus({{0, 0, 0.12}, {1, 0, 0, 0}}, 0.12, 0.004);
  EXPECT_FALSE(stylus.update({0, 0, 0}, {0, 0, 0.01})) << "nothing right has been seen yet";
  EXPECT_TRUE(stylus.update({0, 0, 0}, {0, 0, 0.003}));
  const rendering::LineProbe good = stylus.stylus();
  for (int i = 1; i < StylusFromEnds::kMaxWrong; ++i) {  // a few late replies are tolerated
    EXPECT_TRUE(stylus.update({0, 0, 0}, {0, 0, 0.006}));
    EXPECT_EQ(stylus.stylus().tail, good.tail);
    EXPECT_NEAR(stylus.stretch(), 0.006, 1e-12);
  }
  EXPECT_FALSE(stylus.update({0, 0, 0}, {0, 0, 0.006}));
  EXPECT_FALSE(stylus.update({0, 0, 0}, {0, 0, -0.006}));
  EXPECT_FALSE(stylus.update({0, 0, 0}, {0, 0, std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_TRUE(stylus.update({0, 0, 0}, {0, 0, 0}));
}

}  // namespace
}  // namespace palpate::runner::devices
