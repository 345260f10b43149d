#include <gtest/gtest.h>

#include "analysis/input/csv_reader.h"

namespace palpate::analysis {
namespace {

const std::vector<std::string_view> kNames{"level", "standard_level", "response_time", "task"};

std::string meant_by(const std::string& name) {
  const auto alike = alike_columns({name}, kNames);
  return alike.empty() ? "" : alike.front().meant;
}

TEST(ColumnNames, CaseSpacesAndSlipsAreAlike) {
  for (const char* name : {"Level", " level ", "LEVEL", "levels", "leve", "lebel"})
    EXPECT_EQ(meant_by(name), "level") << name;
  for (const char* name : {"Response Time", "responseTime", "response-time", "resp0nse_tme"})
    EXPECT_EQ(meant_by(name), "response_time") << name;
  for (const char* name : {"", "___", "l", "colour", "lapels", "time", "talks", "respons_tme_x"})
    EXPECT_EQ(meant_by(name), "") << name;
  EXPECT_EQ(meant_by(std::string(65, 'l')), "");
}

TEST(ColumnNames, KeepsExistingNames) {
  EXPECT_TRUE(alike_columns({"level", "Level"}, kNames).empty());
  EXPECT_TRUE(alike_columns({"task", "level"}, kNames).empty());
  const auto both = alike_columns({"Level", "x", "Task"}, kNames);
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(sentence(both[0]), "Column 'Level' is not known and was not read; is 'level' meant?");
  EXPECT_EQ(hint_for("task", both), " (is 'Task' meant?)");
  EXPECT_EQ(hint_for("response_time", both), "");
}

}  // namespace
}  // namespace palpate::analysis
