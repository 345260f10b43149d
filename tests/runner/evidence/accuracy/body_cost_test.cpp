// The cost of a tick with moving bodies in `palpate accuracy`: its figures for known times.

#include <gtest/gtest.h>

#include <cstddef>

#include "runner/evidence/accuracy/body_study.h"

namespace palpate::runner::evidence {
namespace {
namespace body_costs {

TEST(BodyTickCost, GivesMedianP99AndWorst) {
  // Ticks take 1, 2, ... 2000 us, in another order; the work between them takes longer.
  double clock = 0;
  std::size_t looks = 0;
  const BodyTickCost cost = body_tick_cost(true, [&] {
    const std::size_t tick = looks / 2;
    const bool ends = looks++ % 2 == 1;
    return clock += ends ? 1e3 * static_cast<double>(tick * 777 % 2000 + 1) : 1e9;
  });
  EXPECT_EQ(cost.ticks, 2000U);
  EXPECT_EQ(looks, 2 * cost.ticks);
  EXPECT_NEAR(cost.median, 1000.5, 0.51) << "either of the two in the middle";
  EXPECT_NEAR(cost.p99, 1980.5, 0.51);
  EXPECT_NEAR(cost.most, 2000, 1e-6);
}

}  // namespace body_costs
}  // namespace
}  // namespace palpate::runner::evidence
