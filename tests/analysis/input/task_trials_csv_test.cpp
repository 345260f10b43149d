// Reading of an export of tasks.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "analysis/input/task_trials.h"
#include "protocols/parse.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::analysis {
namespace {

class TaskTrialsCsv : public ::testing::Test {
 protected:
  TaskTable read(const std::string& rows) {
    std::ofstream(path_)
        << "participant_id,session,block,trial,task,block_name,renderer,shape,level,"
           "response,success,practice\n"
        << rows;
    return read_task_trials_csv(path_);
  }

  std::string refusal(const std::string& rows) {
    try {
      read(rows);
    } catch (const protocols::InputError& error) {
      return error.what();
    }
    return "";
  }

  const palpate::testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "trials.csv";
};

TEST_F(TaskTrialsCsv, GivesEachTrialThatIsNotPractice) {
  const TaskTable table = read(
      "P1,1,1,1,compare,softer,ray,cube,300,2,1,1\n"
      "P1,1,1,2,compare,softer,ray,cube,350.5,2,1,0\n"
      "P1,1,1,3,compare,softer,ray,cube,400,1,0,0\n");
  EXPECT_EQ(table.n_practice, 1U);
  ASSERT_EQ(table.trials.size(), 2U);
  EXPECT_EQ(table.trials[0].participant, "P1");
  EXPECT_EQ(table.trials[0].task, "compare");
  EXPECT_EQ(table.trials[0].block_name, "softer");
  EXPECT_EQ(table.trials[0].level, 350.5);
  EXPECT_TRUE(table.trials[0].success);
  EXPECT_FALSE(table.trials[1].success);
  EXPECT_TRUE(table.trials[1].answered);
}

TEST_F(TaskTrialsCsv, OfPracticeAloneIsRefused) {
  EXPECT_NE(refusal("P1,1,1,1,compare,softer,ray,cube,300,2,1,1\n")
                .find("at least one trial that is not practice"),
            std::string::npos);
}

TEST_F(TaskTrialsCsv, WithATrialTwiceNamesBothLines) {
  const std::string said = refusal(
      "P1,1,1,1,compare,softer,ray,cube,300,2,1,0\n"
      "P1,1,1,1,compare,softer,ray,cube,300,2,1,0\n");
  EXPECT_NE(said.find("line 3"), std::string::npos) << said;
  EXPECT_NE(said.find("it is in line 2, too"), std::string::npos) << said;
  EXPECT_EQ(said.find("at least one trial"), std::string::npos) << said;
}

}  // namespace
}  // namespace palpate::analysis
