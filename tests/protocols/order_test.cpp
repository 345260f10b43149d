#include "protocols/order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <string>

#include "protocols/schedule.h"

namespace palpate::protocols {
namespace {

using Counts = std::vector<int>;
using Sequence = std::vector<int>;

const std::vector<std::string> kNames = {"a", "b", "c", "d", "e", "f"};

Protocol::Order limits(std::optional<int> max_run, std::optional<int> min_distance = std::nullopt) {
  Protocol::Order order;
  order.max_run = max_run;
  order.min_distance = min_distance;
  return order;
}

/// Whether a whole sequence keeps the limits, from their definition.
bool valid(const Sequence& sequence, const Protocol::Order& order) {
  int run = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    run = i > 0 && sequence[i] == sequence[i - 1] ? run + 1 : 1;
    if (order.max_run && run > *order.max_run) return false;
    for (std::size_t j = 0; j < i; ++j) {
      if (order.min_distance && sequence[j] == sequence[i] &&
          i - j < static_cast<std::size_t>(*order.min_distance)) {
        return false;
      }
    }
  }
  return true;
}

Sequence sorted(const Counts& counts) {
  Sequence sequence;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    sequence.insert(sequence.end(), static_cast<std::size_t>(counts[i]), static_cast<int>(i));
  }
  return sequence;
}

std::vector<Sequence> all_valid(const Counts& counts, const Protocol::Order& order) {
  std::vector<Sequence> found;
  Sequence sequence = sorted(counts);
  do {
    if (valid(sequence, order)) found.push_back(sequence);
  } while (std::next_permutation(sequence.begin(), sequence.end()));
  return found;
}

/// Every assignment of counts to `stimuli` stimuli with a sum of at most `total`.
void for_each_counts(int stimuli, int total, const std::function<void(const Counts&)>& visit) {
  Counts counts(static_cast<std::size_t>(stimuli), 0);
  const std::function<void(std::size_t, int)> fill = [&](std::size_t i, int left) {
    if (i == counts.size()) {
      visit(counts);
      return;
    }
    for (counts[i] = 0; counts[i] <= left; ++counts[i]) fill(i + 1, left - counts[i]);
    counts[i] = 0;
  };
  fill(0, total);
}

std::vector<Protocol::Order> all_limits() {
  std::vector<Protocol::Order> all = {limits({})};
  for (int r = 1; r <= 4; ++r) all.push_back(limits(r));
  for (int d = 1; d <= 5; ++d) all.push_back(limits({}, d));
  all.push_back(limits(2, 1));
  all.push_back(limits(2, 2));
  all.push_back(limits(1, 3));
  return all;
}

// Checks feasibility, and that both methods of drawing find a valid order whenever there is one.
TEST(Order, AgreesWithBruteForceOnEverySmallCase) {
  int solvable = 0, unsolvable = 0;
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (const Protocol::Order& order : all_limits()) {
    for (int stimuli = 1; stimuli <= 4; ++stimuli) {
      for_each_counts(stimuli, 8, [&](const Counts& counts) {
        const bool possible = !all_valid(counts, order).empty();
        ASSERT_EQ(can_order(counts, order), possible) << ::testing::PrintToString(counts);
        ++(possible ? solvable : unsolvable);
        for (const std::size_t budget : {std::size_t{0}, std::size_t{100}}) {
          if (!possible) {
            EXPECT_THROW(order_block(counts, order, kNames, random, budget), ScheduleError);
            continue;
          }
          Sequence sequence = order_block(counts, order, kNames, random, budget);
          EXPECT_TRUE(valid(sequence, order)) << ::testing::PrintToString(sequence);
          std::sort(sequence.begin(), sequence.end());
          EXPECT_EQ(sequence, sorted(counts));
        }
      });
    }
  }
  EXPECT_GT(solvable, 1000);
  EXPECT_GT(unsolvable, 1000);
}

// Construction can give every valid order: it excludes only invalid ones.
TEST(Order, ConstructionReachesEveryValidOrder) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (const auto& order : {limits(1), limits(2), limits({}, 3)}) {
    for (const Counts& counts : {Counts{2, 2, 2}, Counts{3, 2, 2}, Counts{4, 2, 1}}) {
      const std::vector<Sequence> expected = all_valid(counts, order);
      if (expected.empty()) continue;
      std::map<Sequence, int> seen;
      for (int i = 0; i < 5000; ++i) ++seen[order_block(counts, order, kNames, random, 0)];
      EXPECT_EQ(seen.size(), expected.size());
    }
  }
}

TEST(Order, HoldsTightLimits) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 50; ++i) {
    // Only one valid order.
    EXPECT_EQ(order_block({5, 4}, limits(1), kNames, random),
              (Sequence{0, 1, 0, 1, 0, 1, 0, 1, 0}));
    EXPECT_TRUE(valid(order_block({3, 3, 3}, limits({}, 3), kNames, random), limits({}, 3)));
    EXPECT_TRUE(valid(order_block({7, 2}, limits(3), kNames, random), limits(3)));
    EXPECT_TRUE(valid(order_block({4, 4, 4, 1}, limits({}, 3), kNames, random), limits({}, 3)));
    // Solvable, but only by delaying the two frequent ones alternately.
    EXPECT_TRUE(valid(order_block({50, 49, 1}, limits(1), kNames, random), limits(1)));
  }
}

TEST(Order, HoldsLimitsInBigBlocks) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  const Counts counts = {2500, 2500, 2500, 2500};
  for (const auto& order :
       {limits(1), limits(2), limits(3), limits({}, 2), limits({}, 3), limits({}, 4)}) {
    const Sequence sequence = order_block(counts, order, kNames, random);
    ASSERT_EQ(sequence.size(), 10000u);
    // valid() checks all pairs; the distances here are at most 4, so windows suffice.
    for (std::size_t i = 0; i + 8 <= sequence.size(); ++i) {
      ASSERT_TRUE(valid({sequence.begin() + static_cast<std::ptrdiff_t>(i),
                         sequence.begin() + static_cast<std::ptrdiff_t>(i) + 8},
                        order));
    }
  }
}

TEST(Order, RefusalSaysWhyAndWhatWouldHelp) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  const auto refusal = [&](const Counts& counts, const Protocol::Order& order) {
    try {
      order_block(counts, order, kNames, random);
    } catch (const ScheduleError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(
      refusal({2, 7}, limits(2)),
      "max_run 2 cannot be satisfied: 'b' is shown 7 times in a block of 9 trials; use a max_run "
      "of at least 3, more of the other stimuli or fewer repetitions in a block");
  EXPECT_TRUE(can_order({2, 7}, limits(3)));
  EXPECT_EQ(
      refusal({3, 3, 3}, limits({}, 5)),
      "min_distance 5 cannot be satisfied: 'a' is shown 3 times in a block of 9 trials; use a "
      "min_distance of at most 3, more stimuli or fewer repetitions in a block");
  EXPECT_NE(refusal({4}, limits({}, 2)).find("at most 1"), std::string::npos);
}

// The number of draws grows with the trials of a block; otherwise long blocks would not be drawn
// uniformly.
TEST(Order, TheBudgetOfDrawsGrowsWithTheBlock) {
  EXPECT_EQ(uniform_draw_budget(2'000'000), 2 * uniform_draw_budget(1'000'000));
  EXPECT_GE(uniform_draw_budget(1), 200u);  // must find an order of probability 1 / 200
}

TEST(Order, SequentialRepeatsTheList) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  Protocol::Order order = limits(1);
  order.kind = OrderKind::sequential;
  EXPECT_EQ(order_block({2, 2, 2}, order, kNames, random), (Sequence{0, 1, 2, 0, 1, 2}));
  // A valid order exists, but not this one.
  EXPECT_THROW(order_block({3, 1, 1}, order, kNames, random), ScheduleError);
}

/// Pearson's statistic against equal frequencies of the expected orders.
double chi_square(const std::map<Sequence, int>& seen, std::size_t orders, int draws) {
  const double expected = static_cast<double>(draws) / static_cast<double>(orders);
  double sum = static_cast<double>(orders - seen.size()) * expected;
  for (const auto& [sequence, times] : seen)
    sum += (times - expected) * (times - expected) / expected;
  return sum;
}

/// Upper quantile of chi-square at 1e-4 (Wilson & Hilferty 1931).
double critical(std::size_t orders) {
  const double f = static_cast<double>(orders - 1);
  return f * std::pow(1 - 2 / (9 * f) + 3.719 * std::sqrt(2 / (9 * f)), 3);
}

struct Case {
  Counts counts;
  Protocol::Order order;
};

void expect_equally_likely(const Case& c, std::uint64_t seed, std::size_t budget) {
  Random random(seed);
  const std::vector<Sequence> orders = all_valid(c.counts, c.order);
  const int draws = 200 * static_cast<int>(orders.size());
  std::map<Sequence, int> seen;
  for (int i = 0; i < draws; ++i) ++seen[order_block(c.counts, c.order, kNames, random, budget)];
  EXPECT_LT(chi_square(seen, orders.size(), draws), critical(orders.size()))
      << ::testing::PrintToString(c.counts);
}

// A session resumed with a newer program must keep its order.
TEST(Order, StaysTheSameAcrossVersionsOfTheProgram) {
  constexpr std::uint64_t kSeed = 5;
  Random one(kSeed), two(kSeed), three(kSeed);
  EXPECT_EQ(order_block({6, 6, 6}, limits(1), kNames, one, 0),
            (Sequence{0, 2, 1, 2, 0, 1, 0, 1, 2, 1, 2, 0, 1, 0, 2, 1, 0, 2}));
  EXPECT_EQ(order_block({4, 4, 4, 4}, limits({}, 3), kNames, two, 0),
            (Sequence{1, 0, 3, 2, 1, 3, 0, 1, 2, 3, 0, 1, 2, 0, 3, 2}));
  EXPECT_EQ(order_block({4, 4, 4, 4}, limits({}), kNames, three),
            (Sequence{3, 0, 3, 2, 2, 3, 1, 2, 0, 2, 0, 3, 1, 0, 1, 1}));
}

// The seeds are fixed: a failure (p < 1e-4) means that the draw is biased.
TEST(Order, EveryValidOrderIsEquallyLikely) {
  for (const Case& c : {Case{{1, 1, 1, 1, 1}, limits({})}, Case{{2, 2, 2}, limits({})},
                        Case{{3, 1, 2}, limits({})}, Case{{2, 2, 2}, limits(1)},
                        Case{{3, 3, 2}, limits(2)}, Case{{2, 2, 2, 1}, limits({}, 3)}}) {
    expect_equally_likely(c, 7, 10000);
  }
}

// Constructed orders come from a biased draw (without the swaps, 10 to 21 % of the draws deviate
// from uniform in these cases); after the swaps no bias is seen.
TEST(Order, ConstructedOrdersAreEquallyLikelyInSmallCases) {
  for (const Case& c :
       {Case{{2, 2, 2}, limits(1)}, Case{{3, 3, 2}, limits(1)}, Case{{3, 3, 2}, limits(2)},
        Case{{2, 2, 2, 1}, limits({}, 3)}, Case{{2, 2, 2}, limits({}, 3)}}) {
    expect_equally_likely(c, 8, 0);
  }
}

}  // namespace
}  // namespace palpate::protocols
