#include "data/base/group_assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace palpate {
namespace {

using Rule = GroupAssignment::Rule;

GroupAssignment groups_of(std::size_t count, Rule rule, int block = 2, std::uint64_t seed = 7) {
  GroupAssignment out{.rule = rule, .block = block, .seed = seed};
  for (std::size_t i = 0; i < count; ++i) out.names.push_back("g" + std::to_string(i));
  return out;
}

TEST(GroupAssignment, WithoutGroupsTheRowIsTheNumber) {
  const GroupAssignment none;
  EXPECT_FALSE(none.any());
  EXPECT_EQ(none.row(17), 17);
  EXPECT_EQ(none.name(17), "");
}

/// Of any g x r consecutive numbers each group has each row of a cycle of r once.
TEST(GroupAssignment, BalancesRowsWithinEachGroup) {
  for (std::size_t count = 2; count <= 4; ++count) {
    for (const int rows : {1, 2, 4, 6}) {
      const GroupAssignment groups = groups_of(count, Rule::balanced);
      const int window = static_cast<int>(count) * rows;
      for (int first = 1; first + window <= 10'000; first += 37) {
        std::set<std::pair<std::size_t, int>> seen;
        for (int n = first; n < first + window; ++n)
          seen.emplace(groups.group(n), (groups.row(n) - 1) % rows);
        ASSERT_EQ(seen.size(), static_cast<std::size_t>(window)) << count << " " << rows;
      }
    }
  }
}

TEST(GroupAssignment, PermutedBlocksStayBalanced) {
  for (const int block : {1, 2, 5}) {
    for (const std::uint64_t seed : {1U, 2U}) {
      const GroupAssignment groups = groups_of(3, Rule::blocked, block, seed);
      std::vector<int> counts(3, 0);
      for (int n = 1; n <= 10'000; ++n) {
        ++counts[groups.group(n)];
        const auto [least, most] = std::ranges::minmax(counts);
        ASSERT_LE(most - least, block) << n;
        ASSERT_EQ(groups.row(n), counts[groups.group(n)]) << n;
      }
    }
  }
}

TEST(GroupAssignment, PermutedBlocksFollowTheSeed) {
  std::set<std::vector<std::size_t>> orders;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const GroupAssignment groups = groups_of(2, Rule::blocked, 4, seed);
    std::vector<std::size_t> order;
    for (int n = 1; n <= 16; ++n) order.push_back(groups.group(n));
    orders.insert(order);
  }
  EXPECT_GE(orders.size(), 19U);
}

TEST(GroupAssignment, NumbersAreFoundAgain) {
  for (const Rule rule : {Rule::balanced, Rule::blocked, Rule::given}) {
    const GroupAssignment groups = groups_of(3, rule, 3);
    for (int n = 1; n <= 500; ++n)
      ASSERT_EQ(groups.number(groups.group(n), groups.row(n)), n) << to_string(rule);
  }
}

TEST(GroupAssignment, MasksFollowTheSeed) {
  std::set<std::vector<std::string>> orders;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    GroupAssignment groups = groups_of(3, Rule::blocked, 2, seed);
    const GroupAssignment open = groups;
    groups.mask();
    EXPECT_EQ(groups.listed(), (std::vector<std::string>{"A", "B", "C"}));
    orders.insert(groups.names);
    for (int number = 1; number <= 20; ++number) {
      EXPECT_EQ(groups.group(number), open.group(number));
      EXPECT_EQ(groups.true_name(groups.find(groups.name(number))), open.name(number));
    }
    const std::vector<std::string> masks = groups.names;
    groups.mask();
    EXPECT_EQ(groups.names, masks);
    EXPECT_EQ(groups.unmasked().names, open.names);
    EXPECT_EQ(groups.unmasked().unmasked().names, open.names);
  }
  EXPECT_EQ(orders.size(), 6U);
}

TEST(GroupAssignment, NamesAreFound) {
  const GroupAssignment groups = groups_of(2, Rule::given);
  EXPECT_EQ(groups.find("g1"), 1U);
  EXPECT_EQ(groups.find("G1"), 2U);
  EXPECT_EQ(groups.name(2), "g1");
}

}  // namespace
}  // namespace palpate
