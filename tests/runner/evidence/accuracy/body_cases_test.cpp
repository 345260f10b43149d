// The cases that measure rigid-body engines: their errors are zero for the motion given by
// mechanics and have the stated size for a wrong one; and the study's rows over them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "runner/evidence/accuracy/body_study.h"

namespace palpate::runner::evidence {
namespace {
namespace body_cases_by_hand {

const Quat kUpright{1, 0, 0, 0};

BodyCase case_of(const std::string& part) {
  for (const BodyCase& one : body_cases(true)) {
    if (one.name.find(part) != std::string::npos) return one;
  }
  throw std::invalid_argument("no case of " + part);
}

/// The moving boxes at the beginning of the case.
std::vector<BoxMotion> beginning(const BodyCase& one) {
  std::vector<BoxMotion> at;
  for (const BodyBox& box : one.boxes) {
    if (box.mass > 0)
      at.push_back({box.pose.position, box.pose.orientation, box.velocity, box.spin});
  }
  return at;
}

TEST(BodyCases, HaveNamesMeasuresAndBoxesThatMove) {
  for (const bool quick : {true, false}) {
    std::set<std::string> names;
    for (const BodyCase& one : body_cases(quick)) {
      EXPECT_TRUE(names.insert(one.name).second && !one.name.empty()) << one.name;
      EXPECT_FALSE(one.measure.empty()) << one.name;
      EXPECT_GT(one.duration, 0) << one.name;
      ASSERT_FALSE(beginning(one).empty()) << one.name;
      for (const BodyBox& box : one.boxes) EXPECT_GT(box.size.x * box.size.y * box.size.z, 0);
      EXPECT_TRUE(one.gravity == Vec3(0) || one.gravity == Vec3(0, 0, -9.81)) << one.name;
    }
    EXPECT_GE(names.size(), 10U);
  }
}

TEST(BodyCases, ConservedQuantitiesHaveNoErrorAtTheStart) {
  for (const BodyCase& one : body_cases(true)) {
    const bool kept = one.measure.find("energy") != std::string::npos ||
                      one.measure.find("momentum") != std::string::npos ||
                      one.measure.find("off its") != std::string::npos;
    if (!kept) continue;
    EXPECT_NEAR(one.error(beginning(one)), 0, 1e-12) << one.name;
  }
}

TEST(BodyCases, EnergyIsOfMotionSpinAndHeight) {
  const BodyCase turning = case_of("middle axis");
  std::vector<BoxMotion> at = beginning(turning);
  at[0].spin *= std::sqrt(1.5);
  EXPECT_NEAR(turning.error(at), 0.5, 1e-12);
  // The same spin about the box's own axes, in any orientation.
  at = beginning(turning);
  at[0].orientation = glm::angleAxis(0.7, glm::normalize(Vec3(1, 2, 3)));
  at[0].spin = at[0].orientation * at[0].spin;
  EXPECT_NEAR(turning.error(at), 0, 1e-12);
  const BodyCase falling = case_of("tumbling on a floor");
  at = beginning(falling);
  const double fallen = 0.1;  // m; half v^2 is g times it
  at[0].centre.z -= fallen;
  EXPECT_GT(falling.error(at), 0.3);
  at[0].velocity = {0, 0, -std::sqrt(2 * 9.81 * fallen)};
  EXPECT_NEAR(falling.error(at), 0, 1e-12);
}

TEST(BodyCases, EqualBodiesExchangeTheirVelocities) {
  const BodyCase two = case_of("head-on");
  std::vector<BoxMotion> at = beginning(two);
  EXPECT_NEAR(two.error(at), 1, 1e-12) << "nothing has met yet";
  std::swap(at[0].velocity, at[1].velocity);
  EXPECT_NEAR(two.error(at), 0, 1e-12);
  const BodyCase five = case_of("cradle");
  at = beginning(five);
  ASSERT_EQ(at.size(), 5U);
  EXPECT_NEAR(five.error(at), 1, 1e-12);
  std::swap(at[0].velocity, at[4].velocity);
  EXPECT_NEAR(five.error(at), 0, 1e-12);
  // Side by side without a gap, except the first, which comes from the left.
  const double edge = five.boxes[0].size.x;
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(at[i + 1].centre.x - at[i].centre.x, edge, 1e-12);
  EXPECT_LT(at[0].centre.x, at[1].centre.x - edge);
  EXPECT_LT(at[1].centre.x - edge - at[0].centre.x, five.boxes[0].velocity.x * five.duration)
      << "it gets there in time";
}

TEST(BodyCases, AWallReversesTheNormalSpeed) {
  const BodyCase wall = case_of("against a wall");
  std::vector<BoxMotion> at = beginning(wall);
  EXPECT_NEAR(wall.error(at), 2 * at[0].velocity.x, 1e-12);
  at[0].velocity.x = -at[0].velocity.x;
  EXPECT_NEAR(wall.error(at), 0, 1e-12);
}

/// Elastic, without friction: energy, momentum and angular momentum are conserved.
TEST(BodyCases, AStruckRodConservesEnergyAndMomenta) {
  const BodyCase rod = case_of("rod");
  std::vector<BoxMotion> at = beginning(rod);
  const double m1 = rod.boxes[0].mass, m2 = rod.boxes[1].mass, speed = -at[1].velocity.y;
  const double arm = at[1].centre.x;
  const Vec3 size = rod.boxes[0].size;
  const double moment = m1 / 12 * (size.x * size.x + size.y * size.y);
  // The impulse is the nonzero one that keeps the energy.
  const double impulse = 2 * speed / (1 / m1 + 1 / m2 + arm * arm / moment);
  at[0].velocity = {0, -impulse / m1, 0};
  at[0].spin = {0, 0, -impulse * arm / moment};
  at[1].velocity = {0, -(speed - impulse / m2), 0};
  const double after = m1 * std::pow(at[0].velocity.y, 2) + m2 * std::pow(at[1].velocity.y, 2) +
                       moment * std::pow(at[0].spin.z, 2);
  EXPECT_NEAR(after, m2 * speed * speed, 1e-12);
  EXPECT_NEAR(rod.error(at), 0, 1e-12);
  at[1].velocity.y -= 0.1 * speed;
  EXPECT_NEAR(rod.error(at), 0.1, 1e-12) << "of the speed before";
}

TEST(BodyCases, MomentumErrorIsRelativeToTheInitialMomentum) {
  const BodyCase six = case_of("six that fly");
  std::vector<double> masses;
  double all = 0;  // kg m/s
  for (const BodyBox& box : six.boxes) {
    masses.push_back(box.mass);
    all += box.mass * glm::length(box.velocity);
  }
  for (std::size_t i = 0; i < masses.size(); ++i) {
    std::vector<BoxMotion> at = beginning(six);
    at[i].velocity += Vec3(0.3, 0, -0.4);
    EXPECT_NEAR(six.error(at), 0.5 * masses[i] / all, 1e-12) << i;
  }
}

TEST(BodyCases, ErrorsAtRestAreInMillimetres) {
  for (const char* name : {"10 kg", "stack"}) {
    const BodyCase one = case_of(name);
    for (std::size_t i = 0; i < beginning(one).size(); ++i) {
      std::vector<BoxMotion> at = beginning(one);
      at[i].centre.z -= 0.003;
      EXPECT_NEAR(one.error(at), 3, 1e-9) << name << ", " << i;
    }
    // Each stands on the previous one.
    double top = 0;
    for (const BodyBox& box : one.boxes) {
      if (box.mass == 0) continue;
      EXPECT_NEAR(box.pose.position.z - box.size.z / 2, top, 1e-12) << name;
      top = box.pose.position.z + box.size.z / 2;
    }
  }
}

TEST(BodyStudy, OurEngineKeepsTheClosedForms) {
  double clock = 0;
  std::vector<double> progress;
  const auto rows = body_study(
      true, [&clock] { return clock += 1e6; }, [&](double done) { progress.push_back(done); });
  std::map<std::string, std::set<std::string>> engines;
  for (const BodyRow& row : rows) {
    EXPECT_TRUE(engines[row.name].insert(row.engine).second) << row.name << " twice";
    EXPECT_EQ(row.measure, case_of(row.name).measure);
    EXPECT_GT(row.us_per_step, 0) << row.name;
    EXPECT_TRUE(std::isfinite(row.error));
    // Boxes fall through each other in no library.
    if (row.name.find("head-on") != std::string::npos) {
      EXPECT_LT(row.error, 0.2) << row.engine;
    } else if (row.name.find("stack") != std::string::npos) {
      EXPECT_LT(row.error, 5) << row.engine << ", mm";
    }
    if (row.engine != "palpate") continue;
    // Cases at rest are judged to millimetres, the others to rounding and to steps of a bounce.
    const bool rests = row.measure.find("mm") != std::string::npos;
    EXPECT_LT(row.error, rests ? 0.05 : 1e-6) << row.name;
  }
  EXPECT_EQ(engines.size(), body_cases(true).size());
  for (const auto& [name, seen] : engines) {
    EXPECT_TRUE(seen.contains("palpate")) << name;
    EXPECT_EQ(seen, engines.begin()->second) << name << ": the same engines for every case";
  }
  EXPECT_TRUE(std::ranges::is_sorted(progress));
  EXPECT_GE(progress.size(), 2U);
}

}  // namespace body_cases_by_hand
}  // namespace
}  // namespace palpate::runner::evidence
