#include <gtest/gtest.h>

#include "runner/evidence/tick_meters.h"
#include "runner/participants/shape_observer.h"
#include "tests/runner/participants/observer_reference.h"

namespace palpate::runner::participants {
namespace {

TEST(ShapeObserverAllocation, UpdateAllocatesNothing) {
  if (!evidence::counts_allocations()) GTEST_SKIP() << "a sanitizer brings its own operator new";
  const ShapeHypotheses hypotheses(test::four_shapes());
  ShapeObserver observer(hypotheses);
  EXPECT_GT(evidence::allocations(), 0u);
  Percept percept;
  percept.tip = {-0.06, 0, 0.03};
  percept.tail = {0.06, 0, 0.03};
  percept.direction = {0, 0, 1};
  for (const bool ray : {false, true}) {
    for (const bool contact : {false, true}) {
      percept.ray = ray;
      percept.contact = contact;
      if (ray) percept.along = 0.05;
      const std::uint64_t before = evidence::allocations();
      observer.update(percept);
      EXPECT_EQ(evidence::allocations(), before) << ray << contact;
    }
  }
}

}  // namespace
}  // namespace palpate::runner::participants
