// In a program of its own, for it replaces operator new.

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "runner/participants/shape_observer.h"
#include "tests/runner/observer_reference.h"

namespace {
thread_local long allocations = 0;
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace palpate {
namespace {

TEST(ShapeObserverAllocation, UpdateAllocatesNothing) {
  const ShapeHypotheses hypotheses(test::four_shapes());
  ShapeObserver observer(hypotheses);
  EXPECT_GT(allocations, 0);
  Percept percept;
  percept.tip = {-0.06, 0, 0.03};
  percept.tail = {0.06, 0, 0.03};
  percept.direction = {0, 0, 1};
  for (const bool ray : {false, true}) {
    for (const bool contact : {false, true}) {
      percept.ray = ray;
      percept.contact = contact;
      if (ray) percept.along = 0.05;
      const long before = allocations;
      observer.update(percept);
      EXPECT_EQ(allocations, before) << ray << contact;
    }
  }
}

}  // namespace
}  // namespace palpate
