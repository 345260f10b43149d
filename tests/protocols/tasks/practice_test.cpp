// Practice with a criterion.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "protocols/tasks/block_order.h"
#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

/// A block of practice, then a main block.
Protocol practised(const char* criterion, int limit) {
  json document = task_study();
  json practice = json::parse(R"({"name": "try", "task": "identify", "stimuli": ["soft", "lump"],
    "renderers": ["ray"], "repetitions": 2})");
  practice["practice"] = {{"criterion", json::parse(criterion)}, {"limit", limit}};
  json counts = practice;
  counts["name"] = "main";
  counts.erase("practice");
  document["blocks"] = {practice, counts};
  return parsed(document);
}

/// Answers right or wrong as given, then right.
/// \return trials of practice
std::vector<Trial> practice_of(const Protocol& protocol, const std::string& answers) {
  SessionPlan plan(protocol, 1, 1);
  std::vector<Trial> shown;
  while (plan.next().practice) {
    const std::size_t at = shown.size();
    shown.push_back(plan.next());
    const char answer = at < answers.size() ? answers[at] : '1';
    plan.answered({answer == '1', answer == '1', answer != '-'});
    EXPECT_GE(plan.size(), plan.done());
  }
  EXPECT_EQ(plan.next().trial, static_cast<int>(shown.size()) + 1);
  EXPECT_TRUE(plan.block_begins());
  return shown;
}

TEST(Practice, EndsOnceEnoughLastAnswersWereRight) {
  const Protocol protocol = practised(R"({"correct": 3, "of": 4})", 30);
  EXPECT_EQ(practice_of(protocol, "1111").size(), 4U);
  EXPECT_EQ(practice_of(protocol, "0111").size(), 4U);
  EXPECT_EQ(practice_of(protocol, "1010").size(), 6U);  // 1010 11: the last four have three
  EXPECT_EQ(practice_of(protocol, "11-0").size(), 7U);  // a time-out is not a right answer
  EXPECT_EQ(practice_of(protocol, "0000000000").size(), 13U);
}

TEST(Practice, EndsAtItsLimitWhateverTheAnswers) {
  const Protocol protocol = practised(R"({"correct": 4, "of": 4})", 7);
  EXPECT_EQ(practice_of(protocol, "0000000000").size(), 7U);
  EXPECT_EQ(most_trials_of(protocol.blocks[0]), 7);
}

TEST(Practice, RepeatsInRoundsWithTheirOwnOrder) {
  const Protocol protocol = practised(R"({"correct": 8, "of": 8})", 40);
  const std::vector<Trial> shown = practice_of(protocol, std::string(40, '0'));
  ASSERT_EQ(shown.size(), 40U);
  std::set<std::vector<int>> orders;
  for (std::size_t round = 0; round < 10; ++round) {
    std::vector<int> order;
    for (std::size_t i = 4 * round; i < 4 * round + 4; ++i) order.push_back(shown[i].stimulus);
    EXPECT_EQ(std::count(order.begin(), order.end(), 0), 2) << "each stimulus twice a round";
    orders.insert(order);
  }
  EXPECT_GE(orders.size(), 3U);
}

TEST(Practice, WithoutCriterionIsShownOnce) {
  json document = task_study();
  document["blocks"][0]["practice"] = true;
  const Protocol protocol = parsed(document);
  EXPECT_EQ(practice_of(protocol, std::string(24, '0')).size(), 24U);
}

}  // namespace
}  // namespace palpate::protocols
