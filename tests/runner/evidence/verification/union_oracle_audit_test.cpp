// The oracle of contact with unions of convex parts, against the definition of an ideal tool, and
// the audit that checks it and the renderers against that definition.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "data/base/random.h"
#include "runner/evidence/verification/union_cases.h"
#include "runner/evidence/verification/union_walks.h"

namespace palpate::runner::evidence {
namespace {

struct Covered {
  long in_contact = 0, several = 0, lagged = 0;
};

// By definition: outside all parts, and at a local minimum of the distance from the virtual tool.
void expect_ideal(const UnionWalk& walk, std::uint64_t seed, Covered& covered) {
  const UnionOracle oracle(walk.parts, walk.tool);
  OraclePose last = walk.path[0];
  for (std::size_t i = 0; i < walk.path.size(); ++i) {
    const OraclePose& pose = walk.path[i];
    const OracleTick tick = oracle.tick(last, pose);
    ASSERT_FALSE(tick.failed) << seed << " tick " << i;
    const OracleAudit audit = oracle.audit(tick.ideal, pose.tip, 1e-11 * oracle.size());
    ASSERT_LE(audit.penetration, 1e-12 * oracle.size()) << seed << " tick " << i;
    ASSERT_LE(audit.descent, 1e-9 * oracle.size()) << seed << " tick " << i;
    Vec3 sum;
    for (const OracleContact& contact : tick.contacts) {
      EXPECT_GT(contact.share, 0);
      sum += contact.share * contact.normal;
    }
    ASSERT_LE(glm::length(sum - (tick.ideal.tip - pose.tip)), 1e-10 * oracle.size()) << seed;
    covered.in_contact += !tick.contacts.empty();
    covered.several += tick.contacts.size() > 1;
    covered.lagged += tick.lagged;
    last = tick.ideal;
  }
}

TEST(UnionOracleAudit, IsAtALocalMinimumOutsideOfRandomClusters) {
  Covered covered;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    expect_ideal(random_union_walk(4, seed, 400), seed, covered);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(covered.in_contact, 5'000);
  EXPECT_GT(covered.several, 1'500);
  EXPECT_LT(covered.lagged, covered.in_contact / 50);
}

TEST(UnionOracleAudit, IsAtALocalMinimumOnGridWalks) {
  Covered covered;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, {5});
    std::vector<std::uint8_t> bytes(300);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
    expect_ideal(grid_walk(bytes, 300), seed, covered);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(covered.in_contact, 5'000);
  EXPECT_GT(covered.several, 1'000);
  EXPECT_LT(covered.lagged, covered.in_contact / 50);
}

// The audit detects deviations.
TEST(UnionOracleAudit, TheAuditDetectsErrors) {
  const UnionOracle oracle(groove(std::numbers::pi / 2), {{Vec3(0), Vec3(0)}});
  const Vec3 virtual_tip(0.001, 0, -0.003);
  const double touching = 1e-11 * oracle.size();
  const auto audit = [&](const Vec3& ideal) {
    return oracle.audit({ideal, Mat3(1)}, virtual_tip, touching);
  };
  EXPECT_LE(audit({0, 0, 0}).descent, 1e-17);
  EXPECT_NEAR(audit({0, 0, 1e-6}).descent, glm::length(Vec3(1e-3, 0, -3.001e-3)), 1e-9);  // floats
  EXPECT_NEAR(audit({1e-6, 0, -1e-6}).penetration, 1e-6, 1e-15);  // to the seam
  EXPECT_NEAR(audit({3e-6, 0, -1e-6}).penetration, 4e-6 * std::sqrt(0.5), 1e-15);
  // On one wall, from which it slides down.
  EXPECT_GT(audit({0.01, 0, 0.01}).descent, 0.01);
}

}  // namespace
}  // namespace palpate::runner::evidence
