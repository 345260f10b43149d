// Reading of an export of tasks.

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "analysis/input/study_table.h"
#include "protocols/parse.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::analysis {
namespace {

class TaskTrialsCsv : public ::testing::Test {
 protected:
  StudyTable read(const std::string& rows) {
    std::ofstream(path_)
        << "participant_id,session,block,trial,task,block_name,renderer,shape,level,"
           "response,success,practice\n"
        << rows;
    return read_study_csv(path_);
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
  const StudyTable table = read(
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

TEST_F(TaskTrialsCsv, RefusesPracticeAlone) {
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
    read_study_csv(path_);
    ADD_FAILURE();
  } catch (const protocols::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("level comes again"), std::string::npos);
  }
}

TEST_F(TaskTrialsCsv, OrdersTrialsWhateverTheOrderOfTheTable) {
  const StudyTable table = read(
      "P1,2,2,1,compare,softer,ray,cube,3,2,1,0\n"
      "P2,1,1,2,compare,softer,ray,cube,6,2,1,0\n"
      "P1,1,1,2,compare,softer,ray,cube,2,2,1,0\n"
      "P2,1,1,1,compare,softer,ray,cube,5,2,1,0\n"
      "P1,1,1,1,compare,softer,ray,cube,1,2,1,0\n");
  std::vector<double> levels;
  for (const StudyTrial& trial : table.trials) levels.push_back(*trial.level);
  EXPECT_EQ(levels, (std::vector<double>{1, 5, 2, 6, 3}));
}

TEST_F(TaskTrialsCsv, NAIsMissingUnlessItNamesAStimulus) {
  const StudyTable table = read("P1,1,1,1,identify,which,ray,cube,,NA,0,0\n");
  EXPECT_EQ(table.trials[0].response, "");
  EXPECT_FALSE(table.trials[0].answered);
  const StudyTable named = read(
      "P1,1,1,1,identify,which,ray,cube,,NA,0,0\n"
      "P1,1,1,2,identify,which,ray,NA,,NA,1,0\n");
  EXPECT_EQ(named.trials[0].response, "NA");
  EXPECT_TRUE(named.trials[0].answered);
}

TEST_F(TaskTrialsCsv, KnowsSourcesOfRowsAndWhichAreTasks) {
  std::ofstream(path_)
      << "participant_id,task,renderer,shape,response,protocol_sha256,program_version\n"
         "P1,,ray,cube,cube,aaaaaa,0.1.0\n"
         "P1,identify,ray,cube,cube,bbbbbb,0.2.0\n";
  EXPECT_EQ(read_study_csv(path_).trials.size(), 2U);
  EXPECT_THROW(read_study_csv(path_, {"cccccc"}), protocols::InputError) << "no such trial";
  const StudyTable table = read_study_csv(path_, {"bbbbbb"});
  EXPECT_EQ(table.trials.size(), 1U);
  EXPECT_EQ(table.provenance.protocol_sha256, std::vector<std::string>{"bbbbbb"});
  EXPECT_EQ(table.provenance.program_versions, std::vector<std::string>{"0.2.0"});
}

TEST_F(TaskTrialsCsv, AStudyOfShapesHasTimesAlone) {
  std::ofstream(path_) << "participant_id,session,block,trial,renderer,shape,response,correct,"
                          "response_time,task\n"
                          "P1,1,1,1,ray,cube,cube,1,2.5,\n"
                          "P1,1,1,2,ray,cone,cube,0,3,\n";
  const StudyTable table = read_study_csv(path_);
  EXPECT_TRUE(table.trials.empty());
  ASSERT_TRUE(table.times);
  ASSERT_EQ(table.times->rows.size(), 2U);
  EXPECT_EQ(table.times->rows[0].response_time, 2.5);
  EXPECT_FALSE(table.times->rows[1].correct);
}

}  // namespace
}  // namespace palpate::analysis
