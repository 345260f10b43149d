#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "runner/devices/falcon/kinematics.h"
#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {
namespace {

Vec3 thighs_at(const Vec3& position) {
  const auto legs = inverse(position);
  EXPECT_TRUE(legs.has_value());
  return legs ? Vec3((*legs)[0].thigh, (*legs)[1].thigh, (*legs)[2].thigh) : Vec3(0);
}

void expect_near(const Vec3& a, const Vec3& b, double tolerance, const char* what) {
  EXPECT_LT(glm::length(a - b), tolerance) << what << ": " << a.x << ' ' << a.y << ' ' << a.z
                                           << " for " << b.x << ' ' << b.y << ' ' << b.z;
}

/// The usable workspace, every 8 mm.
std::vector<Vec3> workspace() {
  std::vector<Vec3> points;
  for (double z = 0.08; z <= 0.176; z += 0.008) {
    for (double x = -0.04; x <= 0.041; x += 0.008) {
      for (double y = -0.04; y <= 0.041; y += 0.008) {
        // At its ends the workspace is narrower.
        if (std::hypot(x, y) < (z < 0.1 || z > 0.15 ? 0.03 : 0.057)) points.emplace_back(x, y, z);
      }
    }
  }
  return points;
}

TEST(FalconKinematics, TheTableOfCosinesMatchesTheAzimuths) {
  for (std::size_t i = 0; i < 3; ++i) {
    const double angle = kLegAzimuth[i] * std::numbers::pi / 180;
    EXPECT_NEAR(kLegCos[i], std::cos(angle), 1e-15);
    EXPECT_NEAR(kLegSin[i], std::sin(angle), 1e-15);
  }
  EXPECT_NEAR(kCountAngle, 6.359048e-4, 1e-10);
}

struct PublishedPose {
  Vec3 position, counts, torque;  ///< m; counts; N m for 1 N along z
};
const std::vector<PublishedPose> kPoses = {
    {{0, 0, 0.125}, {-200.10, -200.10, -200.10}, {25.243, 25.243, 25.243}},
    {{0.030, 0, 0.125}, {60.04, -616.72, 232.31}, {20.022, 40.461, 11.455}},
    {{0, 0.030, 0.125}, {-608.90, 30.38, 253.53}, {40.166, 21.099, 10.706}},
    {{-0.020, 0.025, 0.100}, {-1264.85, -101.54, -487.96}, {35.274, 7.718, 19.582}},
    {{0.025, -0.030, 0.150}, {984.57, 32.84, 476.47}, {-5.629, 39.886, 27.626}}};

TEST(FalconKinematics, KnownPosesHaveKnownCountsAndTorques) {
  for (const auto& pose : kPoses) {
    const auto legs = inverse(pose.position);
    ASSERT_TRUE(legs);
    expect_near(encoder_counts(thighs_at(pose.position)), pose.counts, 0.01, "counts");
    const auto torque = torque_for(jacobian(*legs), {0, 0, 1});
    ASSERT_TRUE(torque);
    expect_near(1e3 * *torque, pose.torque, 1e-3, "torque, mN m");
  }
}

TEST(FalconKinematics, KnownTorquesOfSidewaysForces) {
  const Jacobian j = jacobian(*inverse(kCentre));
  expect_near(1e3 * torque_for(j, {1, 0, 0}).value(), {17.890, -60.600, 42.710}, 1e-3, "x");
  expect_near(1e3 * torque_for(j, {0, 1, 0}).value(), {-59.646, 14.330, 45.316}, 1e-3, "y");
}

TEST(FalconKinematics, KnownCountsHaveKnownPositions) {
  const std::vector<std::pair<Vec3, Vec3>> known = {
      {{0, 0, 0}, {0, 0, 0.134602}},
      {{-500, -500, -500}, {0, 0, 0.110754}},
      {{-300, -200, -100}, {0.001659, 0.006646, 0.124779}},
      {{400, 100, -250}, {-0.005439, -0.023748, 0.135772}}};
  for (const auto& [counts, position] : known) {
    const auto found = forward(thigh_angles(counts), {0, 0, 0.12});
    ASSERT_TRUE(found);
    expect_near(found->position, position, 1e-6, "position");
  }
}

TEST(FalconKinematics, KnownCountsOnTheAxis) {
  const std::vector<std::pair<double, double>> known = {{0.08, -1284}, {0.10, -741}, {0.12, -304},
                                                        {0.14, 115},   {0.16, 580},  {0.175, 1056}};
  for (const auto& [z, count] : known) {
    const Vec3 counts = encoder_counts(thighs_at({0, 0, z}));
    expect_near(counts, Vec3(count), 1, "counts");
  }
}

TEST(FalconKinematics, JacobianAgreesWithFiniteDifferences) {
  constexpr double kStep = 1e-6;
  for (const Vec3& p : workspace()) {
    const Jacobian j = jacobian(*inverse(p));
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 step(0);
      step[axis] = kStep;
      const Vec3 slope = (thighs_at(p + step) - thighs_at(p - step)) / (2 * kStep);
      for (int leg = 0; leg < 3; ++leg) {
        // Relative to a link's 1/a = 17 rad/m.
        EXPECT_NEAR(j[static_cast<std::size_t>(leg)][axis], slope[leg], 2e-6)
            << "leg " << leg << ", axis " << axis << " at " << p.x << ' ' << p.y << ' ' << p.z;
      }
    }
  }
}

TEST(FalconKinematics, ForwardInvertsInverseOverTheWorkspace) {
  for (const Vec3& p : workspace()) {
    const Vec3 thighs = thighs_at(p);
    const auto cold = forward(thighs, {0, 0, 0.12});
    ASSERT_TRUE(cold) << p.x << ' ' << p.y << ' ' << p.z;
    expect_near(cold->position, p, 1e-11, "cold");
    // A hand at 5 m/s moves 5 mm in a tick.
    const auto warm = forward(thighs, p + Vec3(0.003, -0.002, 0.0035));
    ASSERT_TRUE(warm);
    expect_near(warm->position, p, 1e-11, "warm");
    EXPECT_LE(warm->iterations, 5);
  }
}

TEST(FalconKinematics, TorqueAndForceAreInverses) {
  for (const Vec3& p : workspace()) {
    const Jacobian j = jacobian(*inverse(p));
    const Vec3 force(0.3, -2, 1.7);
    const auto torque = torque_for(j, force);
    ASSERT_TRUE(torque);
    expect_near(force_of(j, *torque), force, 1e-10, "force");
  }
}

TEST(FalconKinematics, ForceInEveryDirectionIsTheSmallestOfAllDirections) {
  const double max_torque = kMaxCount / std::abs(kCountsPerTorque);
  const double sure = force_in_every_direction(kCentre, max_torque);
  EXPECT_NEAR(sure, 6.1, 0.1);  // from the table of the scale
  const Jacobian j = jacobian(*inverse(kCentre));
  double least = 1e9;
  for (double polar = 0; polar <= std::numbers::pi; polar += 0.01) {
    for (double turn = 0; turn < 2 * std::numbers::pi; turn += 0.01) {
      const Vec3 direction(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                           std::cos(polar));
      const Vec3 torque = torque_for(j, direction).value();
      least = std::min(least, max_torque / std::max({std::abs(torque.x), std::abs(torque.y),
                                                     std::abs(torque.z)}));
    }
  }
  EXPECT_GE(least, sure * (1 - 1e-12));
  EXPECT_LT(least, sure * 1.001);
}

TEST(FalconKinematics, UnreachablePosesHaveNoSolution) {
  EXPECT_FALSE(inverse({0, 0, 0.5}));
  EXPECT_FALSE(inverse({0.3, 0, 0.12}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(inverse({nan, 0, 0.12}));
  EXPECT_FALSE(inverse({0, inf, 0.12}));
  EXPECT_FALSE(forward({nan, 0, 0}, kCentre));
  EXPECT_FALSE(forward({inf, 0, 0}, kCentre));
  EXPECT_TRUE(forward(thigh_angles({0, 0, 0}), {nan, nan, nan}));  // a bad start is replaced
  EXPECT_EQ(force_in_every_direction({0, 0, 0.5}, 1), 0);
}

/// Every 16-bit triple must give a plausible position or none.
TEST(FalconKinematics, AbsurdCountsGiveNoPosition) {
  for (int a = -32768; a <= 32767; a += 5461) {
    for (int b = -32768; b <= 32767; b += 5461) {
      for (int c = -32768; c <= 32767; c += 5461) {
        const auto found = forward(thigh_angles({a, b, c}), kCentre);
        if (!found) continue;
        EXPECT_LE(std::hypot(found->position.x, found->position.y), kWidest);
        EXPECT_GE(found->position.z, kNearest);
        EXPECT_LE(found->position.z, kFarthest);
      }
    }
  }
}

TEST(FalconKinematics, FramesAreRightHandedAndInverse) {
  const Vec3 x = to_world({1, 0, 0}), y = to_world({0, 1, 0}), z = to_world({0, 0, 1});
  EXPECT_EQ(x, Vec3(1, 0, 0));   // right
  EXPECT_EQ(y, Vec3(0, 0, 1));   // up
  EXPECT_EQ(z, Vec3(0, -1, 0));  // towards the user
  EXPECT_EQ(glm::cross(x, y), z);
  EXPECT_EQ(from_world(to_world({1, 2, 3})), Vec3(1, 2, 3));
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
