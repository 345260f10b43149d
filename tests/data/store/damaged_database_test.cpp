// Damaged or forged databases: never a crash, never a file outside of the target, only palpate's
// own errors.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Transaction.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <random>
#include <set>

#include "data/export/csv.h"
#include "data/export/datasets.h"
#include "data/merge/merge.h"
#include "data/store/store.h"
#include "tests/data/store/seal_again.h"
#include "tests/data/store/store_fixture.h"
#include "tests/shared/rounds.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

/// A study with everything that exports read.
void make_study(const std::string& path) {
  Store store = Store::open(path, Store::Mode::write_or_create);
  for (const char* code : {"P1", "P2"}) {
    const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), code), a_run());
    for (int trial = 1; trial <= 4; ++trial) {
      TrialRecord record = a_record(trial);
      record.samples.resize(40);
      for (std::uint32_t i = 0; i < 40; ++i) {
        record.samples[i].tick = i;
        record.samples[i].depth = 1.0 / (i + trial);
      }
      record.attempt = store.begin_attempt(run, record, 1);
      store.finish_attempt(run, record);
    }
    store.begin_attempt(run, a_plan(5), 1);
    store.add_note(run, 1, "a note");
    store.end_run(run, RunEnd::paused, 9);
  }
}

class DamagedDatabase : public ::testing::Test {
 protected:
  DamagedDatabase() {
    make_study(path_);
    fs::create_directory(folder_ / "out");
    original_ = contents_of(path_);
  }
  /// Reads a database in every way. \return the number of ways that succeeded.
  int use(const std::string& path) {
    int done = 0;
    std::string refused;
    const auto attempt = [&](const std::function<void()>& work) {
      try {
        work();
        ++done;
      } catch (const StoreError& error) {
        EXPECT_NE(std::string(error.what()), "");
        refused += error.what();
        refused += '\n';
      }
    };
    const ExportSettings settings{.force = true};
    attempt([&] {
      Store store = Store::open(path, Store::Mode::read_only);
      attempt([&] { export_csv(store, folder_ / "out/trials.csv", settings); });
      attempt([&] { export_bids(store, folder_ / "out/bids", settings); });
      attempt([&] { export_psychds(store, folder_ / "out/psychds", settings); });
      attempt([&] { store.participant_summary("P1"); });
      attempt([&] { store.notes(); });
      attempt([&] { store.runs(); });
    });
    fs::remove(folder_ / "out/merged.db");
    attempt([&] { merge(folder_ / "out/merged.db", {path}); });
    attempt([&] { Store::open(path, Store::Mode::write_or_create).forget("P2"); });
    refusals_ = refused;
    return done;
  }
  /// No way of reading left a file outside of out/.
  void expect_nothing_outside() {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      names.insert(entry.path().filename().string());
    }
    EXPECT_EQ(names, (std::set<std::string>{"out", "study.db"}));
    for (const auto& entry : fs::directory_iterator(folder_ / "out")) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(name == "trials.csv" || name == "attempts.csv" || name == "bids" ||
                  name == "psychds" || name == "merged.db")
          << name;
    }
  }
  /// Writes like a program that ignores CHECKs.
  void write_forbidden(const std::string& sql) {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    db.exec(
        "PRAGMA ignore_check_constraints = ON; PRAGMA foreign_keys = OFF; PRAGMA "
        "legacy_alter_table = ON");
    db.exec(sql);
    // A forger of such a file can also forge its seals.
    SQLite::Transaction transaction(db);
    try {
      seal_again(db);
      transaction.commit();
    } catch (const SQLite::Exception&) {
    }
  }
  void clean() {
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      if (entry.path().filename() != "out") fs::remove_all(entry.path());
    }
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
  std::string original_, refusals_;
};

TEST_F(DamagedDatabase, AnUndamagedDatabaseIsExported) {
  EXPECT_EQ(use(path_), 9) << refusals_;
  expect_nothing_outside();
}

TEST_F(DamagedDatabase, DamagedBytesAnywhere) {
  constexpr std::uint32_t kSeed = 11;
  std::mt19937 random(kSeed);
  for (int round = 0; round < palpate::testing::rounds(80); ++round) {
    std::string damaged = original_;
    const int times = 1 + static_cast<int>(random() % 3);
    for (int i = 0; i < times; ++i) {
      char& byte = damaged[random() % damaged.size()];
      byte = round % 2 == 0 ? static_cast<char>(byte ^ (1 << random() % 8))
                            : static_cast<char>(random());
    }
    clean();
    write_file(path_, damaged);
    use(path_);
    expect_nothing_outside();
  }
}

TEST_F(DamagedDatabase, ATruncatedFileIsRefusedAndLeftAlone) {
  constexpr std::uint32_t kSeed = 12;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 60; ++round) {
    const std::size_t size = round % 2 == 0 ? 4096 * (random() % (original_.size() / 4096))
                                            : random() % original_.size();
    clean();
    write_file(path_, original_.substr(0, size));
    EXPECT_EQ(use(path_), 0) << size;
    expect_nothing_outside();
  }
}

/// Values that the schema forbids, written by a program that ignores CHECKs.
struct Crafted {
  const char* what;
  std::string sql;
  const char* expectation;  ///< part of the refusal; "" if all ways succeed
};

TEST_F(DamagedDatabase, ValuesThatPalpateNeverWrites) {
  const Crafted all[] = {
      {"a code that leads out of the folder",
       "UPDATE participants SET code = '../../x' WHERE id = 1", "damaged"},
      {"a code with a separator", "UPDATE participants SET code = 'a/b' WHERE id = 1", "damaged"},
      {"an empty code", "UPDATE participants SET code = '' WHERE id = 1", "damaged"},
      {"a number that is none", "UPDATE participants SET seed = 'x', simulated = 1 WHERE id = 1",
       "damaged"},
      {"a state that is none", "UPDATE attempts SET state = 'x' WHERE id = 1",
       "neither running nor completed nor cut off"},
      {"practice that is neither", "UPDATE attempts SET practice = 2 WHERE id = 1",
       "practice is out of range: 2"},
      {"an answer that is neither", "UPDATE attempts SET correct = -1 WHERE id = 1",
       "correct is out of range: -1"},
      {"a start that is neither", "UPDATE attempts SET started_inside = 7 WHERE id = 1",
       "started_inside is out of range: 7"},
      {"a trial without an answer's time", "UPDATE attempts SET response_time = NULL WHERE id = 1",
       "row 1 of attempts: response_time is missing"},
      {"a trial without a response", "UPDATE attempts SET response = NULL WHERE id = 1",
       "row 1 of attempts: response is missing"},
      {"a trial without a time zero", "UPDATE attempts SET onset_ns = NULL WHERE id = 1",
       "row 1 of attempts: onset_ns is missing"},
      {"a trial without a place", "UPDATE attempts SET start_tail_z = NULL WHERE id = 1",
       "row 1 of attempts: start_tail_z is missing"},
      {"no number of faults", "UPDATE attempts SET faults = NULL WHERE id = 1",
       "row 1 of attempts: faults is missing"},
      {"ticks below nothing", "UPDATE attempts SET ticks = -1 WHERE id = 1",
       "ticks is out of range: -1"},
      {"a block before the first", "UPDATE attempts SET block = 0 WHERE id = 1",
       "block is not 1 or more"},
      {"a trial before the first", "UPDATE attempts SET trial = 0 WHERE id = 1",
       "trial is not 1 or more"},
      {"an attempt before the first", "UPDATE attempts SET attempt = 0 WHERE id = 1",
       "attempt is not 1 or more"},
      {"a time-out with an answer",
       "UPDATE attempts SET timed_out = 1, correct = 0, response = 'cube' WHERE id = 1",
       "time-out has a response or is correct"},
      {"a completed trial that was cut off",
       "UPDATE attempts SET cut_off_reason = 'x' WHERE id = 1",
       "row 1 of attempts: a completed attempt has a reason"},
      {"cut off for no reason",
       "UPDATE attempts SET cut_off_reason = NULL WHERE state = 'cut_off' AND run_id = 1",
       "a cut-off attempt has no reason"},
      {"a number below the first", "UPDATE participants SET number = 0 WHERE id = 1", "damaged"},
      {"a run that ended otherwise", "UPDATE runs SET end_reason = 'x' WHERE id = 1", "damaged"},
      {"a trial number beyond int", "UPDATE attempts SET trial = 4294967297 WHERE id = 1",
       "out of range"},
      {"a negative session", "UPDATE sessions SET number = -5 WHERE id = 1", "damaged"},
      {"no orientation", "UPDATE attempts SET orientation_w = 9e999 WHERE id = 1",
       "not a finite number"},
      {"an infinite time", "UPDATE attempts SET response_time = -9e999 WHERE id = 1",
       "not a finite number"},
      {"a time below zero", "UPDATE attempts SET response_time = -0.5 WHERE id = 1",
       "is below zero"},
      {"a shape that is no text",
       "UPDATE attempts SET shape = CAST(x'FF2E2E2F' AS TEXT) WHERE id = 1", "not UTF-8"},
      {"a shape with NUL", "UPDATE attempts SET shape = CAST(x'610062' AS TEXT) WHERE id = 1",
       "not UTF-8"},
      {"a device that is no text", "UPDATE runs SET device = CAST(x'C0AF' AS TEXT) WHERE id = 1",
       "not UTF-8"},
      {"times at the ends of 64 bits",
       "UPDATE attempts SET onset_ns = -9223372036854775808 WHERE id = 1; UPDATE attempts SET "
       "onset_ns = "
       "9223372036854775807 WHERE id = 2; UPDATE runs SET started_utc_ns = 9223372036854775807 "
       "WHERE id = 2",
       ""},
      {"samples that are none", "UPDATE samples SET data = x'00' WHERE attempt_id = 1",
       "samples are damaged"},
      {"more samples than there are", "UPDATE samples SET count = 41 WHERE attempt_id = 1",
       "samples are damaged"},
      {"terabytes of samples",
       "UPDATE samples SET count = 9223372036854775807 WHERE attempt_id = 1", "is damaged"},
      {"samples packed otherwise", "UPDATE samples SET packing = 7 WHERE attempt_id = 1",
       "packing"},
      {"a name that leads out of the folder", "UPDATE protocols SET name = '../../x'", ""},
      {"a name of nothing that a file can have", "UPDATE protocols SET name = '/'", ""},
      {"a name as long as a book",
       "UPDATE protocols SET name = replace(hex(zeroblob(5000)), '00', 'xy')", ""},
      {"two names that end alike",
       "INSERT INTO protocols VALUES (2, '" + checksum_hex("x") +
           "', '..', 'x'); UPDATE protocols SET name = '.' WHERE id = 1; UPDATE participants SET "
           "protocol_id = 2 WHERE id = 2",
       ""},
      {"a checksum that leads out of the folder",
       "UPDATE protocols SET sha256 = '" +
           std::string("../../../../../../../../../../../../../../../../../../../../tmp/x") + "'",
       "damaged"},
      {"formulas, SQL and control characters",
       "UPDATE attempts SET shape = '=cmd|''/c calc''!A1', response = '@SUM(1;2)\x01\x7f' WHERE id "
       "= 1; "
       "UPDATE runs SET device = '''); DROP TABLE attempts; --', program_version = '-1+1'",
       ""},
      {"a tombstone that takes days",
       "INSERT INTO tombstones VALUES (1, '$6$rounds=999999999$aaaaaaaaaaaaaaaa$x', 1, NULL)",
       "tombstone"},
      {"a tombstone that is a path", "INSERT INTO tombstones VALUES (1, '../x', 1, NULL)",
       "tombstone"},
      {"a trigger", "CREATE TRIGGER t AFTER INSERT ON participants BEGIN DELETE FROM attempts; END",
       "trigger"},
      {"a view in place of a table",
       "ALTER TABLE notes RENAME TO old; CREATE VIEW notes AS SELECT * FROM old",
       "not defined as palpate defines it"},
      {"a table without its checks",
       "ALTER TABLE notes RENAME TO old; CREATE TABLE notes (id INTEGER PRIMARY KEY, run_id, "
       "at_ns, text)",
       "not defined as palpate defines it"},
      {"no index", "DROP INDEX attempts_of_run", "is missing"},
      {"an attempt of another's run", "UPDATE attempts SET run_id = 2 WHERE id = 1",
       "another session"},
      {"a row of nobody", "DELETE FROM participants WHERE id = 1",
       "refer to rows that are missing"},
  };
  for (const Crafted& one : all) {
    clean();
    write_file(path_, original_);
    write_forbidden(one.sql);
    const int done = use(path_);
    if (*one.expectation == '\0') {
      EXPECT_EQ(done, 9) << one.what << ": " << refusals_;
    } else {
      EXPECT_LT(done, 9) << one.what;
      EXPECT_TRUE(contains(refusals_, one.expectation)) << one.what << ": " << refusals_;
    }
    expect_nothing_outside();
  }
}

TEST_F(DamagedDatabase, CsvKeepsTextsExceptForTheGuard) {
  {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    db.exec("UPDATE attempts SET shape = '=1+1', response = ',\"\r\n\t' WHERE id = 1");
    seal_again(db);
  }
  use(path_);
  EXPECT_TRUE(contains(contents_of(folder_ / "out/trials.csv"), ",'=1+1,\",\"\"\r\n\t\","));
  Store store = Store::open(path_, Store::Mode::read_only);
  EXPECT_TRUE(
      contains(error_of([&] { export_bids(store, folder_ / "out/bids2", ExportSettings{}); }),
               "cannot be written to a TSV file"));
  EXPECT_FALSE(fs::exists(folder_ / "out/bids2"));
}

TEST_F(DamagedDatabase, WritersFindForbiddenRowsAtOnceReadersLater) {
  for (const char* const forbidden :
       {"trial = 0", "attempt = 0", "block = 0", "practice = 2", "response = NULL", "correct = 2",
        "timed_out = 2", "timed_out = 1", "response_time = NULL", "onset_ns = NULL", "ticks = -1",
        "missed_ticks = -1", "faults = -1", "started_inside = 2", "max_force = NULL",
        "contact_share = 1.001", "contact_share = -0.001", "edge_dwell = -1"}) {
    clean();
    write_file(path_, original_);
    write_forbidden("UPDATE attempts SET " + std::string(forbidden) + " WHERE id = 2");
    EXPECT_THROW(Store::open(path_, Store::Mode::write_or_create), StoreError) << forbidden;
    EXPECT_THROW(
        Store::open(path_, Store::Mode::read_only).for_each_trial([](const StoredTrial&) {}),
        StoreError)
        << forbidden;
  }
}

TEST_F(DamagedDatabase, DetectsRowsHiddenByADamagedIndex) {
  // An index without one row hides the row from every export that uses the index.
  SQLite::Database db(path_, SQLite::OPEN_READWRITE);
  db.exec(
      "PRAGMA writable_schema = ON; CREATE TABLE keep AS SELECT rootpage FROM sqlite_schema WHERE "
      "name = 'sqlite_autoindex_attempts_1'; UPDATE sqlite_schema SET rootpage = (SELECT rootpage "
      "FROM sqlite_schema WHERE name = 'attempts_of_run') WHERE name = "
      "'sqlite_autoindex_attempts_1'");
  EXPECT_LT(use(path_), 9);
}

}  // namespace
}  // namespace palpate::data
