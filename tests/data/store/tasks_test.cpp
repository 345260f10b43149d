// Tasks of trials and answers to pages: kept to the bit, sealed, merged, forgotten.

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "data/merge/merge.h"
#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using testing::a_plan;
using testing::a_protocol;
using testing::a_record;
using testing::a_run;
using testing::TemporaryFolder;

TaskRecord a_task() {
  TaskRecord task;
  task.task = "compare";
  task.block_name = "stairs";
  task.track = 2;
  task.level = 0.1 + 0.2;
  task.standard_level = 1.0 / 3;
  task.catch_trial = true;
  return task;
}

TrialRecord a_compared_trial(int trial) {
  TrialRecord record = a_record(trial);
  record.task = a_task();
  record.task.intervals = {{"ball", "ray", std::nullopt, true, 11, 22},
                           {"", "point", 5e-324, false, 33, 44}};
  record.task.success = true;
  record.task.number = -0.75;
  record.task.confidence = 3;
  record.task.confidence_ns = 9'007'199'254'740'993;  // not representable as a double
  return record;
}

PageAnswer an_answer(const std::string& item, const std::string& answer) {
  return {"about-you", item, "2026-1", std::string(64, 'a'), answer, 4'000'000'000};
}

/// One participant with two trials and two answers.
void record_study(const std::string& path, const std::string& code, int number) {
  Store store = Store::open(path, Store::Mode::write_or_create);
  const Run run = store.begin_run(store.enrol(a_protocol(), code, number), a_run());
  store.add_page_answers(run, {an_answer("age", "37"), an_answer("more", "")});
  for (const int trial : {1, 2}) {
    TrialRecord record = a_compared_trial(trial);
    TrialRecord plan = a_plan(trial);
    plan.task = a_task();
    record.attempt = store.begin_attempt(run, plan, record.onset_ns);
    store.finish_attempt(run, record);
  }
  store.end_run(run, RunEnd::done, 90'000'000'000);
}

std::vector<TrialRecord> trials_of(const std::string& path) {
  Store store = Store::open(path, Store::Mode::read_only);
  std::vector<TrialRecord> trials;
  store.for_each_trial([&](const StoredTrial& trial) { trials.push_back(trial.record); });
  return trials;
}

void expect_same(const TaskRecord& got, const TaskRecord& want) {
  EXPECT_EQ(got.task, want.task);
  EXPECT_EQ(got.block_name, want.block_name);
  EXPECT_EQ(got.track, want.track);
  EXPECT_EQ(got.level, want.level);
  EXPECT_EQ(got.standard_level, want.standard_level);
  EXPECT_EQ(got.catch_trial, want.catch_trial);
  EXPECT_EQ(got.success, want.success);
  EXPECT_EQ(got.number, want.number);
  EXPECT_EQ(got.confidence, want.confidence);
  EXPECT_EQ(got.confidence_ns, want.confidence_ns);
  ASSERT_EQ(got.intervals.size(), want.intervals.size());
  for (std::size_t i = 0; i < got.intervals.size(); ++i) {
    EXPECT_EQ(got.intervals[i].stimulus, want.intervals[i].stimulus);
    EXPECT_EQ(got.intervals[i].renderer, want.intervals[i].renderer);
    EXPECT_EQ(got.intervals[i].level, want.intervals[i].level);
    EXPECT_EQ(got.intervals[i].standard, want.intervals[i].standard);
    EXPECT_EQ(got.intervals[i].onset_ns, want.intervals[i].onset_ns);
    EXPECT_EQ(got.intervals[i].end_ns, want.intervals[i].end_ns);
  }
}

std::string refusal_of(const std::string& path) {
  try {
    trials_of(path);
  } catch (const StoreRefused& refused) {
    return refused.what();
  }
  return "";
}

TEST(Tasks, AreKeptToTheBit) {
  const TemporaryFolder folder;
  record_study(folder / "a.db", "P1", 1);
  const std::vector<TrialRecord> trials = trials_of(folder / "a.db");
  ASSERT_EQ(trials.size(), 2U);
  for (const TrialRecord& trial : trials) {
    ASSERT_TRUE(trial.task.of_block());
    expect_same(trial.task, a_compared_trial(1).task);
  }
}

TEST(Tasks, CutOffAttemptsNameTheStimulus) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "a.db", Store::Mode::write_or_create);
  const auto run = store.begin_run(store.enrol(a_protocol(), "P1"), a_run());
  TrialRecord plan = a_plan(1);
  plan.task = a_task();
  store.begin_attempt(run, plan, 1);
  store.cut_off_attempt(run, "device fault");
  int seen = 0;
  store.for_each_cut_off([&](const StoredTrial& attempt) {
    ++seen;
    ASSERT_TRUE(attempt.record.task.of_block());
    expect_same(attempt.record.task, a_task());
  });
  EXPECT_EQ(seen, 1);
}

TEST(Tasks, NoBlockMeansIdentificationAndStoresNothing) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "a.db", Store::Mode::write_or_create);
  const auto run = store.begin_run(store.enrol(a_protocol(), "P1"), a_run());
  store.begin_attempt(run, a_plan(1), 1);
  TrialRecord right = a_record(1);
  right.correct = right.task.success = true;
  store.finish_attempt(run, right);
  SQLite::Database db(folder / "a.db");
  EXPECT_EQ(db.execAndGet("SELECT count(*) FROM attempts WHERE task IS NULL").getInt(), 1);
  store.for_each_trial(
      [&](const StoredTrial& trial) { expect_same(trial.record.task, right.task); });

  TrialRecord other = a_record(2);
  other.task.task = "compare";
  store.begin_attempt(run, a_plan(2), 2);
  EXPECT_THROW(store.finish_attempt(run, other), StoreRefused) << "which block asked it?";
}

TEST(Tasks, ThatWereChangedDoNotMatchTheirSeal) {
  const TemporaryFolder folder;
  record_study(folder / "a.db", "P1", 1);
  SQLite::Database(folder / "a.db", SQLite::OPEN_READWRITE)
      .exec("UPDATE attempts SET task = replace(task, 'true', 'false') WHERE trial = 2");
  EXPECT_NE(refusal_of(folder / "a.db").find("trial 2"), std::string::npos);
}

TEST(PageAnswers, AreKeptInTheirOrderAndSealed) {
  const TemporaryFolder folder;
  record_study(folder / "a.db", "P1", 1);
  {
    Store store = Store::open(folder / "a.db", Store::Mode::write_or_create);
    const std::vector<StoredPageAnswer> answers = store.page_answers();
    ASSERT_EQ(answers.size(), 2U);
    EXPECT_EQ(answers[0].participant.code, "P1");
    EXPECT_EQ(answers[0].answer.item, "age");
    EXPECT_EQ(answers[0].answer.answer, "37");
    EXPECT_EQ(answers[0].answer.version, "2026-1");
    EXPECT_EQ(answers[0].answer.at_ns, 4'000'000'000);
    EXPECT_EQ(answers[1].answer.answer, "");
    EXPECT_EQ(store.answers_in_force(answers[0].participant, 1).size(), 2U);
    EXPECT_TRUE(store.answers_in_force(answers[0].participant, 2).empty());
  }
  EXPECT_EQ(refusal_of(folder / "a.db"), "");
  SQLite::Database(folder / "a.db", SQLite::OPEN_READWRITE)
      .exec("UPDATE page_answers SET answer = '73' WHERE item = 'age'");
  EXPECT_NE(refusal_of(folder / "a.db").find("answer to a page 1"), std::string::npos);
}

TEST(PageAnswers, StayOnRecordWhenTheyAreCorrected) {
  const TemporaryFolder folder;
  {
    Store store = Store::open(folder / "a.db", Store::Mode::write_or_create);
    const Participant person = store.enrol(a_protocol(), "P1", 1);
    const data::Run run = store.begin_run(person, a_run(1));
    store.add_page_answers(run, {an_answer("age", "37"), an_answer("more", "")});
    PageAnswer corrected = an_answer("age", "38");
    corrected.at_ns = 9'000'000'000;
    store.add_page_answers(run, {corrected});
    const std::vector<PageAnswer> in_force = store.answers_in_force(person, 1);
    ASSERT_EQ(in_force.size(), 2U);
    EXPECT_EQ(in_force[0].answer, "38");
    EXPECT_EQ(in_force[0].at_ns, 9'000'000'000);
    const std::vector<StoredPageAnswer> all = store.page_answers();
    ASSERT_EQ(all.size(), 3U);
    EXPECT_EQ(all[0].answer.answer, "37");
    EXPECT_TRUE(all[0].replaced);
    EXPECT_FALSE(all[1].replaced);
    EXPECT_FALSE(all[2].replaced);
  }
  EXPECT_EQ(refusal_of(folder / "a.db"), "");
}

TEST(PageAnswers, AreMergedAndForgottenWithTheirParticipant) {
  const TemporaryFolder folder;
  record_study(folder / "a.db", "P1", 1);
  record_study(folder / "b.db", "P2", 2);
  merge(folder / "all.db", {folder / "a.db", folder / "b.db"});
  Store store = Store::open(folder / "all.db", Store::Mode::write_or_create);
  EXPECT_EQ(store.page_answers().size(), 4U);
  EXPECT_EQ(trials_of(folder / "all.db").size(), 4U);
  store.forget("P1");
  const std::vector<StoredPageAnswer> left = store.page_answers();
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[0].participant.code, "P2");
}

}  // namespace
}  // namespace palpate::data
