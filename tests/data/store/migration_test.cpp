// Migration from one version to the next, with made-up steps from the current version; then the
// real steps from version 1.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <vector>

#include "data/store/schema.h"
#include "data/store/store.h"
#include "tests/data/store/old_database.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

constexpr int kNow = kSchemaVersion;
constexpr Migration kSteps[] = {
    {kNow, "ALTER TABLE participants ADD COLUMN glove TEXT NOT NULL DEFAULT 'none'"},
    {kNow + 1, "UPDATE participants SET glove = 'nitrile'; CREATE TABLE gloves (name TEXT) STRICT"},
    {kNow + 2, "DROP TABLE gloves"},
};

class Migrating : public ::testing::Test {
 protected:
  Migrating() {
    Store store = Store::open(path_, Store::Mode::write_or_create);
    const palpate::data::Run run =
        store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
    store.record_simulated(run, {a_record(1), a_record(2)});
    store.end_run(run, RunEnd::done, 1);
  }
  static int version_of(const std::string& path) {
    return SQLite::Database(path, SQLite::OPEN_READWRITE)
        .execAndGet("PRAGMA user_version")
        .getInt();
  }
  /// The database is still the fixture's, and a store opens it.
  void expect_untouched() {
    EXPECT_EQ(version_of(path_), kNow);
    EXPECT_EQ(Store::open(path_, Store::Mode::write_or_create).counts().completed, 2);
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
  const std::string copy_ = path_ + ".v" + std::to_string(kNow) + ".backup";
};

TEST_F(Migrating, RunsTheStepsInOrderAfterACopy) {
  std::string copy;
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    copy = migrate(db, path_, kNow, kNow + 2, kSteps);
    EXPECT_EQ(db.execAndGet("PRAGMA user_version").getInt(), kNow + 2);
    EXPECT_EQ(db.execAndGet("SELECT glove FROM participants").getString(), "nitrile");
    EXPECT_EQ(db.execAndGet("SELECT count(*) FROM gloves").getInt(), 0)
        << "the last step is not asked for";
    EXPECT_EQ(db.execAndGet("SELECT count(*) FROM attempts").getInt(), 2);
    EXPECT_EQ(checked_version(db, path_, kNow + 2), kNow + 2);
  }
  EXPECT_EQ(copy, copy_);
  struct stat found {};
  ASSERT_EQ(::stat(copy.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
  EXPECT_EQ(version_of(copy), kNow);
  EXPECT_EQ(Store::open(copy, Store::Mode::read_only).counts().completed, 2);
  EXPECT_THROW(Store::open(path_, Store::Mode::write_or_create), StoreRefused)
      << "now from the future";
}

TEST_F(Migrating, AnEarlierCopyIsKept) {
  write_file(copy_, "an earlier copy");
  SQLite::Database db(path_, SQLite::OPEN_READWRITE);
  EXPECT_EQ(migrate(db, path_, kNow, kNow + 1, kSteps),
            path_ + ".v" + std::to_string(kNow) + "-2.backup");
  EXPECT_EQ(contents_of(copy_), "an earlier copy");
}

TEST_F(Migrating, FailedStepsLeaveTheDatabaseUnchanged) {
  constexpr Migration kBroken[] = {{kNow, "DELETE FROM attempts"},
                                   {kNow + 1, "DELETE FROM nowhere"}};
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    EXPECT_TRUE(contains(error_of([&] { migrate(db, path_, kNow, kNow + 2, kBroken); }), path_));
  }
  expect_untouched();
}

TEST_F(Migrating, MissingStepsLeaveTheDatabaseUnchanged) {
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    EXPECT_TRUE(contains(error_of([&] { migrate(db, path_, kNow, kNow + 9, kSteps); }),
                         "from schema version " + std::to_string(kNow + 3) + " to "));
  }
  expect_untouched();
}

TEST_F(Migrating, BrokenReferencesAreDetectedBeforeTheCommit) {
  constexpr Migration kCruel[] = {{kNow, "DELETE FROM sessions"}};
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    EXPECT_TRUE(contains(error_of([&] { migrate(db, path_, kNow, kNow + 1, kCruel); }),
                         "stays at version " + std::to_string(kNow)));
  }
  expect_untouched();
}

TEST_F(Migrating, TheMigrationsLeadToThisVersion) {
  int version = 1;
  for (const auto& step : migrations()) EXPECT_EQ(step.from, version++);
  EXPECT_EQ(version, kSchemaVersion);
}

TEST(VersionOne, IsReadAsItIs) {
  const TemporaryFolder folder;
  const std::string path = folder / "old.db";
  make_version_1(path);
  const std::string before = contents_of(path);
  Store store = Store::open(path, Store::Mode::read_only);
  EXPECT_EQ(store.counts().completed, 2);
  store.for_each_trial(
      [](const StoredTrial& trial) {
        EXPECT_FALSE(trial.record.contact_share) << "nobody measured it";
        EXPECT_FALSE(trial.record.edge_dwell);
      },
      false);
  EXPECT_EQ(contents_of(path), before);
}

TEST(VersionOne, BecomesThisVersionWhenItIsWrittenTo) {
  const TemporaryFolder folder;
  const std::string path = folder / "old.db";
  make_version_1(path);
  for (int again = 0; again < 2; ++again) {
    Store store = Store::open(path, Store::Mode::write_or_create);
    EXPECT_EQ(store.counts().completed, 2);
    store.enrol(a_protocol(), "P2");
  }
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  EXPECT_EQ(checked_version(db, path), kNow);
  EXPECT_NO_THROW(verify_schema(db, path, kNow)) << "as if it had been made today";
  SQLite::Database backup(path + ".v1.backup", SQLite::OPEN_READWRITE);
  EXPECT_EQ(checked_version(backup, path), 1);
  EXPECT_NO_THROW(verify_schema(backup, path, 1));
  EXPECT_EQ(backup.execAndGet("SELECT count(*) FROM attempts").getInt(), 2);
}

}  // namespace
}  // namespace palpate::data
