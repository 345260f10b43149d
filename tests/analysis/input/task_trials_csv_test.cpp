// Reading of an export of tasks.

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

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

TEST_F(TaskTrialsCsv, ARowOfAnotherLengthIsRefused) {
  for (const char* last :
       {"P1,1,1,2,compare,softer,ray,cube,300,2", "P1,1,1,2,compare,softer,ray,cube,300,2,1,0,7"})
    EXPECT_NE(refusal("P1,1,1,1,compare,softer,ray,cube,300,2,1,0\n" + std::string(last))
                  .find("line 3: expected 12 fields, as in the header"),
              std::string::npos);
}

TEST_F(TaskTrialsCsv, AColumnThatComesTwiceIsRefused) {
  std::ofstream(path_) << "participant_id,task,renderer,shape,response,success,level,level\n"
                          "P1,compare,ray,cube,2,1,300,500\n";
  try {
    read_task_trials_csv(path_);
    ADD_FAILURE();
  } catch (const protocols::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("level comes again"), std::string::npos);
  }
}

TEST_F(TaskTrialsCsv, TrialsStandInTheirOrderWhateverThatOfTheTable) {
  const TaskTable table = read(
      "P1,2,2,1,compare,softer,ray,cube,3,2,1,0\n"
      "P2,1,1,2,compare,softer,ray,cube,6,2,1,0\n"
      "P1,1,1,2,compare,softer,ray,cube,2,2,1,0\n"
      "P2,1,1,1,compare,softer,ray,cube,5,2,1,0\n"
      "P1,1,1,1,compare,softer,ray,cube,1,2,1,0\n");
  std::vector<double> levels;
  for (const TaskTrial& trial : table.trials) levels.push_back(*trial.level);
  EXPECT_EQ(levels, (std::vector<double>{1, 5, 2, 6, 3}));
}

TEST_F(TaskTrialsCsv, NAIsNoAnswerUnlessAStimulusHasThatName) {
  const TaskTable table = read("P1,1,1,1,identify,which,ray,cube,,NA,0,0\n");
  EXPECT_EQ(table.trials[0].response, "");
  EXPECT_FALSE(table.trials[0].answered);
  const TaskTable named = read(
      "P1,1,1,1,identify,which,ray,cube,,NA,0,0\n"
      "P1,1,1,2,identify,which,ray,NA,,NA,1,0\n");
  EXPECT_EQ(named.trials[0].response, "NA");
  EXPECT_TRUE(named.trials[0].answered);
}

TEST_F(TaskTrialsCsv, KnowsWhereRowsComeFromAndWhichAreOfTasks) {
  std::ofstream(path_)
      << "participant_id,task,renderer,shape,response,protocol_sha256,program_version\n"
         "P1,,ray,cube,cube,aaaaaa,0.1.0\n"
         "P1,identify,ray,cube,cube,bbbbbb,0.2.0\n";
  EXPECT_TRUE(has_task_trials(path_));
  EXPECT_FALSE(has_task_trials(path_, "aaaaaa"));
  EXPECT_TRUE(has_task_trials(path_, "bbbbbb"));
  EXPECT_TRUE(has_task_trials(path_, "cccccc"));
  const TaskTable table = read_task_trials_csv(path_, "bbbbbb");
  EXPECT_EQ(table.provenance.protocol_sha256, std::vector<std::string>{"bbbbbb"});
  EXPECT_EQ(table.provenance.program_versions, std::vector<std::string>{"0.2.0"});
}

}  // namespace
}  // namespace palpate::analysis
