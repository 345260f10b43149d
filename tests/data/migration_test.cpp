// Version 1 is the first, so the way from one version to the next is tested with made-up steps.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <vector>

#include "data/schema.h"
#include "data/store.h"
#include "tests/data/store_fixture.h"

namespace palpate {
namespace {

using namespace palpate::testing;

constexpr Migration kSteps[] = {
    {1, "ALTER TABLE participants ADD COLUMN glove TEXT NOT NULL DEFAULT 'none'"},
    {2, "UPDATE participants SET glove = 'nitrile'; CREATE TABLE gloves (name TEXT) STRICT"},
    {3, "DROP TABLE gloves"},
};

class Migrating : public ::testing::Test {
 protected:
  Migrating() {
    Store store = Store::open(path_, Store::Mode::write_or_create);
    const palpate::Run run = store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
    store.record_simulated(run, {a_record(1), a_record(2)});
    store.end_run(run, RunEnd::done, 1);
  }
  static int version_of(const std::string& path) {
    return SQLite::Database(path, SQLite::OPEN_READWRITE)
        .execAndGet("PRAGMA user_version")
        .getInt();
  }
  /// The database still is the one that the fixture made, and a store takes it.
  void expect_untouched() {
    EXPECT_EQ(version_of(path_), 1);
    EXPECT_EQ(Store::open(path_, Store::Mode::write_or_create).counts().completed, 2);
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

TEST_F(Migrating, RunsTheStepsInOrderAfterACopy) {
  std::string copy;
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    copy = migrate(db, path_, 1, 3, kSteps);
    EXPECT_EQ(db.execAndGet("PRAGMA user_version").getInt(), 3);
    EXPECT_EQ(db.execAndGet("SELECT glove FROM participants").getString(), "nitrile");
    EXPECT_EQ(db.execAndGet("SELECT count(*) FROM gloves").getInt(), 0)
        << "step 3 is not for version 3";
    EXPECT_EQ(db.execAndGet("SELECT count(*) FROM attempts").getInt(), 2);
    EXPECT_EQ(checked_version(db, path_, 3), 3);
  }
  EXPECT_EQ(copy, path_ + ".v1.backup");
  struct stat found {};
  ASSERT_EQ(::stat(copy.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
  EXPECT_EQ(version_of(copy), 1);
  EXPECT_EQ(Store::open(copy, Store::Mode::read_only).counts().completed, 2);
  EXPECT_THROW(Store::open(path_, Store::Mode::write_or_create), StoreRefused)
      << "now from the future";
}

TEST_F(Migrating, AnEarlierCopyIsKept) {
  write_file(path_ + ".v1.backup", "an earlier copy");
  SQLite::Database db(path_, SQLite::OPEN_READWRITE);
  EXPECT_EQ(migrate(db, path_, 1, 2, kSteps), path_ + ".v1-2.backup");
  EXPECT_EQ(contents_of(path_ + ".v1.backup"), "an earlier copy");
}

TEST_F(Migrating, AStepThatFailsLeavesTheDatabaseAsItWas) {
  constexpr Migration kBroken[] = {{1, "DELETE FROM attempts"}, {2, "DELETE FROM nowhere"}};
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    EXPECT_TRUE(contains(error_of([&] { migrate(db, path_, 1, 3, kBroken); }), path_));
  }
  expect_untouched();
}

TEST_F(Migrating, AMissingStepLeavesTheDatabaseAsItWas) {
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    EXPECT_TRUE(contains(error_of([&] { migrate(db, path_, 1, 9, kSteps); }),
                         "from schema version 4 to 9"));
  }
  expect_untouched();
}

TEST_F(Migrating, RowsLeftAloneAreSeenBeforeTheCommit) {
  constexpr Migration kCruel[] = {{1, "DELETE FROM sessions"}};
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    EXPECT_TRUE(
        contains(error_of([&] { migrate(db, path_, 1, 2, kCruel); }), "stays at version 1"));
  }
  expect_untouched();
}

TEST_F(Migrating, TheRealStepsLeadToThisVersion) {
  int version = 1;
  for (const auto& step : migrations()) EXPECT_EQ(step.from, version++);
  EXPECT_EQ(version, kSchemaVersion);
}

}  // namespace
}  // namespace palpate
