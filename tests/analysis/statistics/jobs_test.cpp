// Parts of work, several at a time.

#include "analysis/statistics/jobs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace palpate::analysis {
namespace {

TEST(Jobs, EachPartIsDoneOnce) {
  for (const std::size_t jobs : {1, 2, 7}) {
    std::vector<std::atomic<int>> done(100);
    double last = 0;
    do_jobs(
        done.size(), jobs, [&](std::size_t i) { ++done[i]; },
        [&](double share) {
          EXPECT_GE(share, last);
          last = share;
        });
    for (const auto& count : done) EXPECT_EQ(count.load(), 1) << jobs;
    EXPECT_LE(last, 1);
    if (jobs == 1) EXPECT_EQ(last, 1);  // else other threads may do all the work
  }
}

TEST(Jobs, AnExceptionEndsTheRestAndIsThrown) {
  for (const std::size_t jobs : {1, 3}) {
    std::atomic<int> done{0};
    const auto fails = [&](std::size_t i) {
      if (i == 5) throw std::runtime_error("the sixth part");
      ++done;
    };
    EXPECT_THROW(do_jobs(1'000'000, jobs, fails, {}), std::runtime_error);
    EXPECT_LT(done.load(), 1'000'000);
  }
}

TEST(Jobs, NoPartsAreNoWork) {
  do_jobs(0, 2, [](std::size_t) { FAIL(); }, {});
}

}  // namespace
}  // namespace palpate::analysis
