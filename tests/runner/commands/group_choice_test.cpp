#include "runner/station/group_choice.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "runner/usage_error.h"

namespace palpate::runner::station {
namespace {

using Rule = GroupAssignment::Rule;

protocols::Protocol grouped(Rule rule) {
  protocols::Protocol protocol;
  protocol.groups.names = {"young", "old"};
  protocol.groups.rule = rule;
  return protocol;
}

std::string refusal(const RunSettings& settings, const protocols::Protocol& protocol,
                    const GroupFacts& facts = {}) {
  try {
    number_in_group(settings, protocol, facts);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

RunSettings in_group(const std::string& group) {
  RunSettings settings;
  settings.participant = "P01";
  settings.group = group;
  return settings;
}

TEST(GroupChoice, GivenGroupsGetTheirNextNumber) {
  const protocols::Protocol protocol = grouped(Rule::given);
  EXPECT_EQ(number_in_group(in_group("old"), protocol, {}), 2);
  EXPECT_EQ(number_in_group(in_group("young"), protocol, {.taken = {1, 2, 3}}), 5);
}

TEST(GroupChoice, ContradictionsAreRefused) {
  const protocols::Protocol given = grouped(Rule::given), balanced = grouped(Rule::balanced);
  EXPECT_NE(refusal(in_group(""), given).find("expected --group with one of young and old"),
            std::string::npos);
  EXPECT_NE(refusal(in_group("Old"), given).find("found 'Old'"), std::string::npos);
  EXPECT_NE(refusal(in_group("old"), balanced).find("assigns groups itself"), std::string::npos);
  EXPECT_NE(refusal(in_group("old"), {}).find("no groups"), std::string::npos);
  RunSettings numbered = in_group("old");
  numbered.number = 3;
  EXPECT_NE(refusal(numbered, given).find("number 3 is in group young"), std::string::npos);
  numbered.number = 4;
  EXPECT_EQ(number_in_group(numbered, given, {}), 4);
}

TEST(GroupChoice, KnownParticipantsKeepTheirGroup) {
  const protocols::Protocol given = grouped(Rule::given);
  EXPECT_EQ(number_in_group(in_group(""), given, {.enrolled = 2}), std::nullopt);
  EXPECT_EQ(number_in_group(in_group("old"), given, {.enrolled = 2}), std::nullopt);
  EXPECT_NE(refusal(in_group("young"), given, {.enrolled = 2}).find("P01 is in group old"),
            std::string::npos);
}

TEST(GroupChoice, FillsTheGroupThatFewestCompleted) {
  const protocols::Protocol balanced = grouped(Rule::balanced);
  RunSettings fill = in_group("");
  fill.fill = true;
  EXPECT_EQ(number_in_group(fill, balanced, {.taken = {1, 2, 3, 4}, .completed = {2, 1}}), 6);
  EXPECT_EQ(number_in_group(fill, balanced, {.taken = {1, 2, 3, 4}, .completed = {1, 2}}), 5);
  EXPECT_EQ(number_in_group(fill, balanced, {.taken = {1, 2, 3}, .completed = {1, 1}}), 4);
  EXPECT_NE(refusal(fill, grouped(Rule::given), {.completed = {0, 0}}).find("use --group"),
            std::string::npos);
  fill.number = 3;
  EXPECT_NE(refusal(fill, balanced, {.completed = {0, 0}}).find("leave out --number"),
            std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::station
