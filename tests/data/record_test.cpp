// Properties of a trial's record.

#include "data/record.h"

#include <gtest/gtest.h>

#include <string>

namespace palpate::data {
namespace {

TrialRecord record_of(const std::string& task) {
  TrialRecord record;
  record.onset_ns = 70;
  record.response = "1";
  record.task.task = task;
  return record;
}

TEST(Record, BeginsWithTheFirstIntervalThatWasFelt) {
  TrialRecord record = record_of("compare");
  EXPECT_EQ(first_onset_ns(record), 70) << "no interval was felt";
  record.task.intervals.resize(3);
  EXPECT_EQ(first_onset_ns(record), 70);
  record.task.intervals[1].onset_ns = 20;
  record.task.intervals[2].onset_ns = 50;
  EXPECT_EQ(first_onset_ns(record), 20);
  record.task = {};
  EXPECT_EQ(first_onset_ns(record), 70) << "of version 1";
}

TEST(Record, NumbersSettingsAndTiesHaveNoRightAnswer) {
  EXPECT_TRUE(has_right_answer(TrialRecord{})) << "identification, version 1";
  for (const char* const task : {"identify", "detect", "compare"})
    EXPECT_TRUE(has_right_answer(record_of(task))) << task;
  for (const char* const task : {"rate", "adjust"})
    EXPECT_FALSE(has_right_answer(record_of(task))) << task;
  // A comparison of two equally stiff stimuli.
  TrialRecord alike = record_of("compare");
  alike.task.intervals.resize(2);
  alike.task.level = alike.task.standard_level = 400;
  EXPECT_FALSE(has_right_answer(alike));
  alike.response = "2";
  EXPECT_FALSE(has_right_answer(alike));
  alike.response = "same";
  EXPECT_TRUE(has_right_answer(alike)) << "that is the right one";
  alike.response = "1";
  alike.task.standard_level = 401;
  EXPECT_TRUE(has_right_answer(alike));
  alike.task.standard_level.reset();
  EXPECT_TRUE(has_right_answer(alike));
  alike.task.level.reset();
  EXPECT_TRUE(has_right_answer(alike)) << "no level was set for either";
}

TEST(Record, EndsOfRunsAreReadAsWritten) {
  for (const RunEnd end : {RunEnd::running, RunEnd::done, RunEnd::paused, RunEnd::withdrawn,
                           RunEnd::aborted, RunEnd::interrupted})
    EXPECT_EQ(parse_run_end(to_string(end)), end);
  EXPECT_EQ(parse_run_end("stopped"), std::nullopt);
  EXPECT_EQ(parse_run_end(""), std::nullopt);
}

}  // namespace
}  // namespace palpate::data
