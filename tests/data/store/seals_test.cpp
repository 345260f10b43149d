// Every change in the record of a session is detected by every reader, with its place.

#include "data/store/seals.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <gtest/gtest.h>

#include <vector>

#include "data/merge/merge.h"
#include "data/store/store.h"
#include "tests/data/store/old_database.h"
#include "tests/data/store/seal_again.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

class Seals : public ::testing::Test {
 protected:
  /// Two participants; the first with two runs, a note, a trial that was cut off, samples.
  Seals() {
    {
      Store store = open();
      const Participant person = store.enrol(a_protocol(), "P1");
      palpate::data::Run run = store.begin_run(person, a_run());
      show(store, run, 1);
      store.add_note(run, 7, "sneezed");
      store.begin_attempt(run, a_plan(2), 8);
      store.cut_off_attempt(run, "device fault");
      show(store, run, 2, true);
      store.end_run(run, RunEnd::paused, 99);
      run = store.begin_run(person, a_run());
      show(store, run, 3);
      store.end_run(run, RunEnd::done, 199);
      run = store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 5), a_run());
      store.record_simulated(run, {a_record(1), a_record(2)});
      store.end_run(run, RunEnd::done, 1);
    }
    original_ = contents_of(path_);
  }
  Store open(Store::Mode mode = Store::Mode::write_or_create) const {
    return Store::open(path_, mode);
  }
  static void show(Store& store, const palpate::data::Run& run, int trial, bool sampled = false) {
    TrialRecord record = a_record(trial);
    record.attempt = store.begin_attempt(run, a_plan(trial), 6);
    if (sampled) record.samples = {SampleRecord{.tick = 0}, SampleRecord{.tick = 1, .depth = 1e-3}};
    store.finish_attempt(run, record);
  }
  void edit(const std::string& sql) {
    write_file(path_, original_);
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    db.exec("PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON");
    db.exec(sql);
  }
  /// The refusal of each way of reading; "": not refused.
  std::vector<std::string> refusals() {
    const auto message = [](const auto& work) -> std::string {
      try {
        work();
      } catch (const StoreRefused& error) {
        return error.what();
      }
      return "";
    };
    std::filesystem::remove(folder_ / "all.db");
    return {
        message([&] { open(Store::Mode::read_only).for_each_trial([](const StoredTrial&) {}); }),
        message([&] { open(Store::Mode::read_only).for_each_cut_off([](const StoredTrial&) {}); }),
        message([&] { merge(folder_ / "all.db", {path_}); })};
  }
  void expect_refused(const std::string& sql, const std::string& words) {
    edit(sql);
    for (const std::string& message : refusals()) {
      EXPECT_TRUE(message.starts_with(path_)) << sql << ": " << message;
      EXPECT_TRUE(contains(message, words)) << sql << ": " << message;
    }
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
  std::string original_;
};

TEST_F(Seals, AnUnchangedDatabasePasses) {
  for (const std::string& message : refusals()) EXPECT_EQ(message, "");
  Store store = open();
  const Participant person = store.participants(a_protocol().sha256).at(0);
  EXPECT_EQ(store.progress(person, 1).completed.size(), 3u);
}

TEST_F(Seals, TheRowThatWasChangedIsNamed) {
  expect_refused("UPDATE attempts SET response_time = 0.5 WHERE run_id = 2",
                 "participant P1, session 1, trial 3, attempt 1: was changed");
  expect_refused("UPDATE attempts SET correct = 1 WHERE trial = 2 AND state = 'completed'",
                 "session 1, trial 2, attempt 2: was changed");
  expect_refused("UPDATE attempts SET cut_off_reason = 'x' WHERE state = 'cut_off'",
                 "trial 2, attempt 1: was changed");
  expect_refused("UPDATE notes SET text = 'slept'", "participant P1, session 1, note 1: was");
  expect_refused("UPDATE runs SET hand = 'left' WHERE id = 2", "session 1, run 2: was changed");
  expect_refused("UPDATE runs SET ended_ns = 9 WHERE id = 2", "session 1, end of run 2: was");
  expect_refused("UPDATE participants SET code = 'P2' WHERE id = 1",
                 "participant P2, session 1, run 1, or its participant");
}

TEST_F(Seals, EveryColumnIsSealed) {
  int columns = 0;
  for (const char* table : {"protocols", "participants", "sessions", "runs", "notes", "attempts"}) {
    write_file(path_, original_);
    std::vector<std::pair<std::string, std::string>> edits;
    {
      SQLite::Database db(path_, SQLite::OPEN_READONLY);
      SQLite::Statement find(db, "SELECT name, type FROM pragma_table_info(?) WHERE name <> 'id'");
      find.bind(1, table);
      while (find.executeStep()) {
        const std::string name = find.getColumn(0).getString(),
                          type = find.getColumn(1).getString();
        const std::string other = type == "TEXT"   ? "coalesce(" + name + ", '') || '1'"
                                  : type == "BLOB" ? "randomblob(32)"
                                                   : "coalesce(" + name + ", 0) + 1";
        edits.emplace_back(name, other);
      }
    }
    for (const auto& [name, other] : edits) {
      ++columns;
      // The first and the last row of a table; the last of attempts has all columns.
      edit("UPDATE " + std::string(table) + " SET " + name + " = " + other +
           " WHERE id = (SELECT max(id) FROM " + table + ")");
      for (const std::string& message : refusals()) {
        EXPECT_NE(message, "") << table << "." << name;
      }
    }
  }
  EXPECT_GT(columns, 60);
}

TEST_F(Seals, RemovedAddedAndSwappedRowsAreDetected) {
  expect_refused("DELETE FROM attempts WHERE trial = 1 AND run_id = 1", "are missing");
  expect_refused("DELETE FROM notes", "are missing");
  expect_refused("DELETE FROM attempts WHERE run_id = 3 AND trial = 2", "are missing");
  expect_refused("INSERT INTO notes (run_id, at_ns, text) VALUES (1, 8, 'late')",
                 "note 2: has no seal");
  expect_refused("UPDATE attempts SET link = NULL, seal = NULL WHERE run_id = 2",
                 "trial 3, attempt 1: has no seal");
  expect_refused(
      "UPDATE attempts SET trial = 9 WHERE run_id = 3 AND trial = 1; UPDATE attempts SET trial = 1 "
      "WHERE run_id = 3 AND trial = 2; UPDATE attempts SET trial = 2 WHERE trial = 9",
      "was changed");
  expect_refused("UPDATE attempts SET link = 2 WHERE run_id = 3", "position of another sealed row");
}

TEST_F(Seals, SamplesAreVerifiedAgainstTheirTrial) {
  for (const char* sql : {"UPDATE samples SET data = x'00'", "UPDATE samples SET count = 1",
                          "DELETE FROM samples", "UPDATE samples SET attempt_id = 1"}) {
    edit(sql);
    const TrialName name{.code = "P1", .session = 1, .trial = 2};
    EXPECT_TRUE(contains(error_of([&] { open(Store::Mode::read_only).attempts(name); }), "samples"))
        << sql;
    EXPECT_TRUE(contains(refusals().at(2), "samples")) << sql;
    EXPECT_EQ(refusals().at(0), "") << "they are not read";
  }
}

TEST_F(Seals, AChangedSessionIsNotResumed) {
  edit("UPDATE attempts SET response = 'cube' WHERE run_id = 2");
  Store store = open();
  const Participant person = store.participants(a_protocol().sha256).at(0);
  EXPECT_TRUE(contains(error_of([&] { store.progress(person, 1); }), "trial 3"));
  const Participant other = store.participants(a_protocol().sha256).at(1);
  EXPECT_EQ(store.progress(other, 1).completed.size(), 2u) << "of others nothing is asked";
}

TEST_F(Seals, NextWriterSealsRowsOfACrashedProcess) {
  {
    Store store = open();
    const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "P3"), a_run());
    show(store, run, 1);
    store.begin_attempt(run, a_plan(2), 8);
    Store reader = open(Store::Mode::read_only);
    reader.for_each_trial([](const StoredTrial&) {});  // an open attempt has no seal yet
  }
  open();
  for (const std::string& message : refusals()) EXPECT_EQ(message, "");
  original_ = contents_of(path_);
  expect_refused(
      "UPDATE runs SET end_reason = 'done', ended_ns = 5 WHERE end_reason = 'interrupted'",
      "participant P3, session 1, end of run 1: was changed");
}

TEST_F(Seals, ATransactionThatFailsLeavesTheChainWhole) {
  {
    Store store = open();
    const palpate::data::Run run =
        store.begin_run(store.enrol(a_protocol(), "S2", {}, true, 6), a_run());
    store.record_simulated(run, {a_record(1)});
    EXPECT_THROW(store.record_simulated(run, {a_record(2), a_record(1)}), StoreRefused);
    store.record_simulated(run, {a_record(2)});
    store.end_run(run, RunEnd::done, 1);
  }
  for (const std::string& message : refusals()) EXPECT_EQ(message, "");
}

TEST_F(Seals, OthersStayWholeWhenOneIsForgotten) {
  open().forget("P1");
  for (const std::string& message : refusals()) EXPECT_EQ(message, "");
  original_ = contents_of(path_);
  expect_refused("UPDATE attempts SET correct = 1 WHERE trial = 1", "participant S1");
}

TEST_F(Seals, MergedDatabasesKeepTheirStationsSeals) {
  merge(folder_ / "merged.db", {path_});
  original_ = contents_of(folder_ / "merged.db");
  edit("SELECT 1");
  for (const std::string& message : refusals()) EXPECT_EQ(message, "");
  expect_refused("UPDATE attempts SET response_time = 0.5 WHERE trial = 3", "trial 3, attempt 1");
}

TEST(SealsOfOldVersions, AreMadeByTheMigration) {
  const TemporaryFolder folder;
  const std::string path = folder / "old.db";
  make_version_1(path);
  Store::open(path, Store::Mode::write_or_create);
  const auto read = [&] {
    Store::open(path, Store::Mode::read_only).for_each_trial([](const StoredTrial&) {});
  };
  EXPECT_NO_THROW(read());
  SQLite::Database(path, SQLite::OPEN_READWRITE)
      .exec("UPDATE attempts SET correct = 0 WHERE id = 2");
  EXPECT_TRUE(
      contains(error_of(read), "participant P1, session 1, trial 2, attempt 1: was changed"));
}

TEST(SealedValues, DifferInSeal) {
  const auto seal = [](const auto&... values) {
    SealedValues row;
    row.begin("row");
    (void)(row << ... << values);
    return row.seal({});
  };
  using Text = std::string;
  EXPECT_NE(seal(Text("ab"), Text("c")), seal(Text("a"), Text("bc")));
  EXPECT_NE(seal(1), seal(1.0));
  EXPECT_NE(seal(std::optional<int>()), seal(0));
  EXPECT_NE(seal(Text()), seal(std::optional<Text>()));
  EXPECT_EQ(seal(std::optional<int>(3)), seal(std::int64_t{3}));
  EXPECT_EQ(to_hex(seal(Text("x"), -1, 0.5)),
            "e676f213430587dcb646e414b38737026a1f378cbfefdbfe4588add5484b3e90")
      << "as worked out elsewhere";
}

}  // namespace
}  // namespace palpate::data
