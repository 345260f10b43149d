#include "data/store/station_database.h"

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>

#include "data/store/schema.h"
#include "tests/data/merge/merge_fixture.h"
#include "tests/data/store/child_process.h"
#include "tests/data/store/old_database.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

TEST_F(Merging, OtherFilesAreRefused) {
  make_station(a_, "P1", 1);
  write_file(b_, "a text");
  EXPECT_TRUE(contains(refusal({a_, b_}), "not a palpate database"));
  write_file(b_, "");
  EXPECT_TRUE(contains(refusal({a_, b_}), "is empty"));
  fs::remove(b_);
  EXPECT_TRUE(contains(refusal({a_, b_}), "no such file"));
  EXPECT_TRUE(contains(refusal({a_, folder_.path()}), "no such file"));
  { SQLite::Database(b_, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec("CREATE TABLE t (x)"); }
  EXPECT_TRUE(contains(refusal({a_, b_}), "another program's"));
  fs::remove(b_);
  make_station(b_, "P2", 2);
  SQLite::Database(b_, SQLite::OPEN_READWRITE)
      .exec("PRAGMA user_version = " + std::to_string(kSchemaVersion + 1));
  EXPECT_TRUE(contains(refusal({a_, b_}), "a newer one"));
}

TEST_F(Merging, ExistingFilesAreNotReplaced) {
  make_station(a_, "P1", 1);
  write_file(out_, "mine");
  EXPECT_TRUE(contains(error_of([&] { merge(out_, {a_}); }), "exists already"));
  EXPECT_EQ(contents_of(out_), "mine");
  EXPECT_TRUE(contains(error_of([&] { merge(a_, {a_}); }), "exists already"));
  fs::remove(out_);
  write_file(out_ + "-wal", "a log");
  EXPECT_TRUE(contains(error_of([&] { merge(out_, {a_}); }), "exists already"));
}

TEST_F(Merging, AnInputThatIsBeingWrittenIsRefused) {
  make_station(a_, "P1", 1);
  ChildProcess holder({"hold", a_});
  ASSERT_EQ(holder.read_line(), "held");
  EXPECT_TRUE(contains(refusal_while_locked({a_}), "open for writing in process"));
}

TEST_F(Merging, ReadsCrashedWritersDatabaseWithoutChangingIt) {
  {
    Store a = open_station(a_);
    const palpate::data::Run run = a.begin_run(a.enrol(a_protocol(), "P1"), a_run());
    TrialRecord record = a_record(1);
    record.attempt = a.begin_attempt(run, record, 1);
    a.finish_attempt(run, record);
    a.begin_attempt(run, a_plan(2), 1);
    // As after a crash: everything in the log, a run in progress.
    for (const char* end : {"", "-wal"}) fs::copy_file(a_ + end, b_ + end);
  }
  const std::string before = contents_of(b_), log = contents_of(b_ + "-wal");
  ASSERT_FALSE(log.empty());
  const MergeResult done = merge(out_, {b_});
  EXPECT_EQ(done.counts.completed, 1);
  EXPECT_EQ(done.counts.cut_off, 1);
  EXPECT_EQ(done.counts.interrupted_runs, 1);
  EXPECT_TRUE(contents_of(b_) == before);
  EXPECT_TRUE(contents_of(b_ + "-wal") == log);
}

TEST_F(Merging, ReadsADatabaseOfTheFirstVersion) {
  make_version_1(a_);
  make_station(b_, "P2", 2);
  const std::string before = contents_of(a_);
  EXPECT_EQ(merge(out_, {a_, b_}).counts.participants, 2);
  EXPECT_TRUE(contents_of(a_) == before);
  EXPECT_FALSE(fs::exists(a_ + ".v1.backup"));
}

}  // namespace
}  // namespace palpate::data
