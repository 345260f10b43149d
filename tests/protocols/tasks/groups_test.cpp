#include "protocols/groups.h"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "tests/protocols/parsed_faults.h"
#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {

nlohmann::json with_groups(const char* assign) {
  nlohmann::json study = task_study();
  study["block_order"] = "counterbalanced";
  study["groups"] = {{"names", {"young", "old"}},
                     {"assign", assign},
                     {"patch", {{"old", {{"breaks", {{"every_trials", 7}}}, {"samples", true}}}}}};
  return study;
}

TEST(Groups, PatchesChangeTheirGroupAlone) {
  const Protocol all = parsed(with_groups("balanced"));
  EXPECT_FALSE(all.samples);
  EXPECT_FALSE(protocol_of(all, 1).samples);
  EXPECT_EQ(protocol_of(all, 1).breaks.every_trials, std::nullopt);
  EXPECT_TRUE(protocol_of(all, 2).samples);
  EXPECT_EQ(protocol_of(all, 2).breaks.every_trials, std::optional(7));
  EXPECT_EQ(protocol_of(all, 2).sha256, all.sha256);
  EXPECT_EQ(&protocol_of(protocol_of(all, 2), 2), &protocol_of(all, 2));
}

TEST(Groups, WithoutGroupsNothingChanges) {
  const Protocol none = parsed(task_study());
  EXPECT_EQ(&protocol_of(none, 5), &none);
  EXPECT_TRUE(none.group_protocols.empty());
}

/// Every order of the blocks occurs equally often in each group.
TEST(Groups, OrdersAreBalancedWithinEach) {
  for (const char* const assign : {"balanced", "blocked", "given"}) {
    const Protocol all = parsed(with_groups(assign));
    std::map<std::string, std::map<std::vector<int>, int>> orders;
    for (int n = 1; n <= 24; ++n)
      ++orders[all.groups.name(n)][blocks_in_order(protocol_of(all, n), n, 1)];
    ASSERT_EQ(orders.size(), 2U) << assign;
    for (const auto& [group, counts] : orders) {
      EXPECT_EQ(counts.size(), 6U) << assign << " " << group;
      for (const auto& [order, count] : counts) EXPECT_EQ(count, 2) << assign << " " << group;
    }
  }
}

TEST(Groups, PlansFollowOwnGroup) {
  nlohmann::json study = with_groups("balanced");
  study["groups"]["patch"]["old"]["blocks"] = nlohmann::json::array({study["blocks"][2]});
  const Protocol all = parsed(study);
  EXPECT_GT(SessionPlan(all, 1, 1).size(), SessionPlan(all, 2, 1).size());
  EXPECT_EQ(SessionPlan(all, 2, 1).block().name, "lumps");
}

/// Draws follow seed and number: those of a participant do not depend on groups.
TEST(Groups, DrawsFollowNumber) {
  nlohmann::json study = with_groups("balanced");
  study.erase("block_order");
  study["groups"].erase("patch");
  const Protocol grouped = parsed(study);
  study.erase("groups");
  const Protocol plain = parsed(study);
  for (const int n : {1, 2, 9}) {
    const auto a = worked_off(SessionPlan(grouped, n, 1)), b = worked_off(SessionPlan(plain, n, 1));
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].level, b[i].level);
      EXPECT_EQ(a[i].orientation, b[i].orientation);
    }
  }
}

TEST(Groups, MaskedGroupsKeepTheirPatches) {
  nlohmann::json study = with_groups("blocked");
  study["groups"]["masked"] = true;
  const Protocol all = parsed(study);
  EXPECT_EQ(all.groups.listed(), (std::vector<std::string>{"A", "B"}));
  for (int number = 1; number <= 8; ++number)
    EXPECT_EQ(protocol_of(all, number).samples,
              all.groups.true_name(all.groups.group(number)) == "old");
  study["groups"]["patch"]["old"]["renderers"] = {"line"};
  const std::vector<Fault> faults =
      faults_when([&] { parse_protocol_text(study.dump(), "study.json"); });
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].location, "/groups/patch/old/renderers/0");
}

TEST(Groups, MasksThatTellAreRefused) {
  nlohmann::json given = with_groups("given"), letter = with_groups("balanced");
  given["groups"]["masked"] = letter["groups"]["masked"] = true;
  letter["groups"]["names"][1] = "B";
  letter["groups"].erase("patch");
  for (const auto& [study, place] :
       {std::pair(given, "/groups/masked"), {letter, "/groups/names/1"}}) {
    const std::vector<Fault> faults =
        faults_when([&] { parse_protocol_text(study.dump(), "study.json"); });
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].location, place);
  }
}

TEST(Groups, FaultsNameTheGroup) {
  nlohmann::json study = with_groups("balanced");
  study["groups"]["patch"]["old"]["renderers"] = {"line"};
  const std::vector<Fault> faults =
      faults_when([&] { parse_protocol_text(study.dump(), "study.json"); });
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].location, "/groups/patch/old/renderers/0");
  EXPECT_EQ(faults[0].expected.rfind("in group 'old': expected one of", 0), 0U)
      << faults[0].expected;
}

}  // namespace
}  // namespace palpate::protocols
