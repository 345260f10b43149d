#include "data/merge/merge.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <set>

#include "data/export/csv.h"
#include "data/store/schema.h"
#include "tests/data/store/child_process.h"
#include "tests/data/store/old_database.h"
#include "tests/data/store/seal_again.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;
using Lines = std::multiset<std::string>;

Store write(const std::string& path) { return Store::open(path, Store::Mode::write_or_create); }

constexpr std::int64_t kDay = 86'400'000'000'000;

/// One live session with everything that can be in one: two runs, a note, an attempt that was cut
/// off, samples.
void show_session(Store& store, const std::string& code, std::optional<int> number = {},
                  int session = 1, char protocol = 'a') {
  const Participant person = store.enrol(a_protocol(protocol), code, number);
  RunInfo info = a_run(session);
  info.clock.utc_ns += session * kDay;
  info.device = "falcon of " + code;
  info.response_latency = 0.003;
  palpate::data::Run run = store.begin_run(person, info);
  store.add_note(run, 7, "a note on " + code);
  store.begin_attempt(run, a_plan(1, session), 5'000'000'000);
  store.end_run(run, RunEnd::paused, 9'000'000'000);
  info.clock.utc_ns += kDay / 2;
  run = store.begin_run(person, info);
  for (int trial = 1; trial <= 3; ++trial) {
    TrialRecord record = a_record(trial, session);
    record.samples.resize(static_cast<std::size_t>(trial - 1) * 10);
    for (std::uint32_t i = 0; i < record.samples.size(); ++i) record.samples[i].tick = i;
    record.attempt = store.begin_attempt(run, record, 1);
    store.finish_attempt(run, record);
  }
  store.end_run(run, RunEnd::done, 90'000'000'000);
}

void make(const std::string& path, const std::string& code, int number) {
  Store store = write(path);
  show_session(store, code, number);
}

/// As if this had been recorded.
void record_otherwise(const std::string& path, const std::string& sql) {
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  db.exec(sql);
  seal_again(db);
}

/// Every line of a CSV export but the header, and of attempts.csv.
Lines exported(const std::string& database, const TemporaryFolder& folder) {
  Store store = Store::open(database, Store::Mode::read_only);
  export_csv(store, folder / "t.csv", true);
  Lines lines;
  for (const char* name : {"t.csv", "attempts.csv"}) {
    std::ifstream in(folder / name);
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) lines.insert(std::string(name) + ": " + line);
    fs::remove(folder / name);
  }
  return lines;
}

/// Notes, runs and samples: what a CSV export does not have.
Lines the_rest(const std::string& database) {
  Store store = Store::open(database, Store::Mode::read_only);
  Lines all;
  for (const auto& note : store.notes()) {
    all.insert(note.participant.code + std::to_string(note.session) + note.utc + note.text);
  }
  for (const auto& run : store.runs()) {
    all.insert(run.participant.code + std::to_string(run.info.session) + to_string(run.end) +
               run.info.device + std::to_string(run.info.clock.utc_ns) +
               std::to_string(run.info.response_latency.value_or(-1)));
  }
  store.for_each_trial(
      [&](const StoredTrial& trial) {
        for (const SampleRecord& sample : trial.record.samples) {
          all.insert(trial.participant.code + std::to_string(trial.record.trial) + "/" +
                     std::to_string(sample.tick));
        }
      },
      true);
  return all;
}

class Merging : public ::testing::Test {
 protected:
  std::string refusal(const std::vector<std::string>& inputs) {
    const std::string message = error_of([&] { merge(out_, inputs); });
    EXPECT_FALSE(fs::exists(out_));
    expect_no_drafts();
    return message;
  }
  std::string refusal_while_locked(const std::vector<std::string>& inputs) {
    const std::string message = error_of([&] { merge(out_, inputs); });
    EXPECT_FALSE(fs::exists(out_));
    return message;
  }
  void expect_no_drafts() {
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      EXPECT_FALSE(contains(entry.path().filename().string(), ".palpate-")) << entry.path();
    }
  }
  const TemporaryFolder folder_, export_folder_;
  const std::string a_ = folder_ / "a.db", b_ = folder_ / "b.db", out_ = folder_ / "all.db";
};

TEST_F(Merging, NumbersGivenTwiceAreRenumberedOnRequestAndTheTrialsKeepTheirOrder) {
  const std::string c = folder_ / "c.db", again = folder_ / "again.db";
  {
    Store a = write(a_), b = write(b_), third = write(c);
    show_session(a, "P1", 1);
    show_session(a, "P2", 2, 2);  // a day later than the other number 2
    show_session(b, "Q1", 1);
    show_session(b, "Q2", 2);
    show_session(third, "R1", 4);
  }
  const std::string message = refusal({a_, b_});
  EXPECT_TRUE(contains(message, "number 1 is that of participant P1 and of participant Q1"));
  EXPECT_TRUE(contains(message, "number 2 is that of participant Q2 and of participant P2"));
  EXPECT_TRUE(contains(message, "--renumber"));
  EXPECT_TRUE(contains(message, "run --number"));
  EXPECT_FALSE(contains(message, "forget")) << "nobody has to go";

  Lines parts = exported(a_, export_folder_);
  parts.merge(exported(b_, export_folder_));
  const MergeResult done = merge(out_, {b_, a_}, {}, NumberConflict::renumber);
  ASSERT_EQ(done.renumbered.size(), 2u);
  EXPECT_EQ(done.renumbered[0].code + done.renumbered[0].other, "Q1P1");
  EXPECT_EQ(done.renumbered[0].from, 1);
  EXPECT_EQ(done.renumbered[0].to, 3);
  EXPECT_EQ(done.renumbered[1].code + done.renumbered[1].other, "P2Q2");
  EXPECT_EQ(done.renumbered[1].to, 4);
  EXPECT_EQ(exported(out_, export_folder_), parts) << "also the number that ordered the trials";
  {
    Store all = write(out_);
    const Participant person = all.look_up(a_protocol(), "P2");
    EXPECT_EQ(person.number, 4);
    EXPECT_EQ(person.enrolled_number, 2);
    EXPECT_EQ(all.look_up(a_protocol(), "NEW").number, 5);
  }
  // The merged one with its parts again, in any order: nothing changes, and nobody asks again.
  const MergeResult repeated = merge(again, {a_, out_, b_});
  EXPECT_TRUE(repeated.renumbered.empty());
  EXPECT_EQ(exported(again, export_folder_), parts);
  EXPECT_EQ(write(again).look_up(a_protocol(), "Q1").number, 3);
  fs::remove(again);
  // A number that was given away by a merge is no claim against a station that counted so far.
  const MergeResult more = merge(again, {out_, c}, {}, NumberConflict::renumber);
  ASSERT_EQ(more.renumbered.size(), 1u);
  EXPECT_EQ(more.renumbered[0].code + more.renumbered[0].other, "P2R1");
  EXPECT_EQ(more.renumbered[0].from, 2);
  EXPECT_EQ(more.renumbered[0].to, 5);
}

TEST_F(Merging, HoldsWhatTheStationsHold) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1);
    show_session(a, "P3", 3);
    show_session(b, "P2", 2);
    show_session(b, "P2", 2, 2);
    show_session(b, "P4", 4);
  }
  Lines parts = exported(a_, export_folder_), rest = the_rest(a_);
  parts.merge(exported(b_, export_folder_));
  rest.merge(the_rest(b_));
  const std::string recorded_a = contents_of(a_), recorded_b = contents_of(b_);
  const MergeResult done = merge(out_, {a_, b_});
  EXPECT_EQ(done.counts.participants, 4);
  EXPECT_EQ(done.counts.sessions, 5);
  EXPECT_EQ(done.counts.runs, 10);
  EXPECT_EQ(done.counts.completed, 15);
  EXPECT_EQ(done.counts.cut_off, 5);
  EXPECT_EQ(done.counts.sampled, 10);
  EXPECT_TRUE(done.excluded.empty());
  EXPECT_EQ(exported(out_, export_folder_), parts);
  EXPECT_EQ(the_rest(out_), rest);
  EXPECT_EQ(contents_of(a_), recorded_a) << "an input was written to";
  EXPECT_EQ(contents_of(b_), recorded_b) << "an input was written to";
  struct stat found {};
  ASSERT_EQ(::stat(out_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
  expect_no_drafts();
  EXPECT_EQ(write(out_).enrol(a_protocol(), "P5").number, 5) << "and can be gone on with";
}

TEST_F(Merging, AgainOrInAnotherOrderIsTheSameToTheByte) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1);
    show_session(b, "P2", 2);
    show_session(b, "P3", 3);
    b.forget("P3");
    show_session(b, "O1", 1, 1, 'b');
    show_session(a, "O2", 2, 1, 'b');
  }
  // Two protocols of one name, known to both stations alike.
  merge(out_, {a_, b_});
  merge(folder_ / "other-order.db", {b_, a_});
  merge(folder_ / "again.db", {out_, a_, out_, b_, a_});
  merge(folder_ / "alone.db", {out_});
  const std::string all = contents_of(out_);
  EXPECT_TRUE(contents_of(folder_ / "other-order.db") == all);
  EXPECT_TRUE(contents_of(folder_ / "again.db") == all);
  EXPECT_TRUE(contents_of(folder_ / "alone.db") == all);
}

TEST_F(Merging, AnotherSessionOfTheSameParticipantIsAdded) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1);
    show_session(b, "P1", 1);  // a copy of the first day, then the second
    show_session(b, "P1", 1, 2);
  }
  EXPECT_EQ(merge(out_, {a_, b_}).counts.sessions, 2);
}

TEST_F(Merging, ListsEveryConflictAndWritesNothing) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1);
    show_session(a, "P2", 2);
    show_session(a, "P3", 3);
    show_session(a, "P4", 4);
    a.enrol(a_protocol(), "S5", 5, true, 1);
    show_session(b, "P1", 1);
    b.add_note(b.begin_run(b.enrol(a_protocol(), "P9", 9), a_run()), 1, "alone");
    show_session(b, "P7", 2);     // number 2 again
    show_session(b, "P3", 8);     // another number
    show_session(b, "P4", 4, 1);  // alike so far
    b.enrol(a_protocol(), "S5", 5, true, 2);
  }
  record_otherwise(
      b_,
      "UPDATE attempts SET response_time = 9 WHERE trial = 3 AND session_id = (SELECT s.id FROM "
      "sessions s JOIN participants p ON p.id = s.participant_id WHERE p.code = 'P4')");
  record_otherwise(a_, "SELECT 1");
  const std::string message = refusal({a_, b_});
  EXPECT_TRUE(contains(message, "number 2 is that of participant P2 and of participant P7"));
  EXPECT_TRUE(contains(message, "participant P3 has number 3 and number 8"));
  EXPECT_TRUE(contains(message, "participant P4: session 1 is not the same"));
  EXPECT_TRUE(contains(message, "participant S5 is simulated at one station"));
  EXPECT_FALSE(contains(message, "P1")) << message;
  EXPECT_FALSE(contains(message, "P9")) << message;
  EXPECT_TRUE(contains(message, a_) && contains(message, b_));
  EXPECT_TRUE(contains(message, "Leave one of the databases out")) << "what to do";
}

TEST_F(Merging, OneDifferenceAnywhereIsAConflict) {
  make(a_, "P1", 1);
  for (const char* change :
       {"UPDATE sessions SET observer_sha256 = 'x'", "UPDATE runs SET hand = 'left' WHERE id = 1",
        "UPDATE notes SET text = 'another'", "UPDATE attempts SET max_force = 9 WHERE trial = 2",
        "UPDATE attempts SET cut_off_reason = 'x' WHERE state = 'cut_off'",
        "UPDATE samples SET data = x'00' WHERE attempt_id = 4",
        "DELETE FROM samples WHERE attempt_id = 4", "DELETE FROM notes",
        "UPDATE attempts SET run_id = 1 WHERE trial = 3",
        "UPDATE attempts SET first_contact_time = NULL WHERE trial = 2"}) {
    fs::copy_file(a_, b_, fs::copy_options::overwrite_existing);
    EXPECT_NO_THROW(merge(out_, {a_, b_}));
    fs::remove(out_);
    record_otherwise(b_, change);
    EXPECT_TRUE(contains(refusal({a_, b_}), "session 1 is not the same")) << change;
  }
}

TEST_F(Merging, NobodyIsAtTwoStationsAtOnce) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1, 1);
    show_session(b, "P1", 1, 2);
  }
  merge(folder_ / "fine.db", {a_, b_});
  record_otherwise(b_, "UPDATE runs SET started_utc_ns = started_utc_ns - 86400000000000");
  EXPECT_TRUE(contains(refusal({a_, b_}), "sessions 1 and 2 were at the same time"));
}

TEST_F(Merging, DifferentProtocolsUnderOneNameAreRefused) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1, 1, 'a');
    show_session(b, "P2", 2, 1, 'b');
  }
  const std::string message = refusal({a_, b_});
  EXPECT_TRUE(contains(message, "protocol ho2000 is not the same")) << message;
  for (const char variant : {'a', 'b'}) {
    EXPECT_TRUE(contains(message, a_protocol(variant).sha256.substr(0, 12))) << message;
  }
  {
    Store a = write(a_);
    show_session(a, "P9", 9, 1, 'b');
  }
  EXPECT_EQ(merge(out_, {a_, b_}).counts.protocols, 2) << "changed at a, which knows both";
}

TEST_F(Merging, WhoHasWithdrawnNeverComesBack) {
  {
    Store a = write(a_), b = write(b_);
    show_session(a, "P1", 1);
    show_session(a, "P2", 2);
    show_session(b, "P2", 2);
    show_session(b, "P3", 3);
    a.forget("P2");
  }
  const MergeResult done = merge(out_, {b_, a_});
  EXPECT_EQ(done.counts.participants, 2);
  ASSERT_EQ(done.excluded.size(), 1u);
  EXPECT_EQ(done.excluded[0].code, "P2");
  EXPECT_EQ(done.excluded[0].path, b_);
  EXPECT_TRUE(contains(error_of([&] { write(out_).enrol(a_protocol(), "P2"); }), "withdrawn"));
  EXPECT_EQ(merge(folder_ / "later.db", {out_, b_}).excluded.size(), 1u)
      << "nor from a later merge";
  write(b_).forget("P3");
  EXPECT_EQ(merge(folder_ / "two.db", {out_, b_}).counts.participants, 1);
  EXPECT_TRUE(
      contains(error_of([&] { write(folder_ / "two.db").enrol(a_protocol(), "P2"); }), "with"));
  EXPECT_TRUE(
      contains(error_of([&] { write(folder_ / "two.db").enrol(a_protocol(), "P3"); }), "with"));
}

TEST_F(Merging, OtherFilesAreRefused) {
  make(a_, "P1", 1);
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
  make(b_, "P2", 2);
  SQLite::Database(b_, SQLite::OPEN_READWRITE)
      .exec("PRAGMA user_version = " + std::to_string(kSchemaVersion + 1));
  EXPECT_TRUE(contains(refusal({a_, b_}), "a newer one"));
}

TEST_F(Merging, WhatIsThereIsNotReplaced) {
  make(a_, "P1", 1);
  write_file(out_, "mine");
  EXPECT_TRUE(contains(error_of([&] { merge(out_, {a_}); }), "is there already"));
  EXPECT_EQ(contents_of(out_), "mine");
  EXPECT_TRUE(contains(error_of([&] { merge(a_, {a_}); }), "is there already"));
  fs::remove(out_);
  write_file(out_ + "-wal", "a log");
  EXPECT_TRUE(contains(error_of([&] { merge(out_, {a_}); }), "is there already"));
}

TEST_F(Merging, AnInputThatIsBeingWrittenIsRefused) {
  make(a_, "P1", 1);
  ChildProcess holder({"hold", a_});
  ASSERT_EQ(holder.read_line(), "held");
  EXPECT_TRUE(contains(refusal_while_locked({a_}), "open for writing in process"));
}

TEST_F(Merging, TakesWhatADeadWriterLeftWithoutTouchingIt) {
  {
    Store a = write(a_);
    const palpate::data::Run run = a.begin_run(a.enrol(a_protocol(), "P1"), a_run());
    TrialRecord record = a_record(1);
    record.attempt = a.begin_attempt(run, record, 1);
    a.finish_attempt(run, record);
    a.begin_attempt(run, a_plan(2), 1);
    // As a crash leaves it: everything in the log, a run under way.
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

TEST_F(Merging, TakesADatabaseOfTheFirstVersion) {
  make_version_1(a_);
  make(b_, "P2", 2);
  const std::string before = contents_of(a_);
  EXPECT_EQ(merge(out_, {a_, b_}).counts.participants, 2);
  EXPECT_TRUE(contents_of(a_) == before);
  EXPECT_FALSE(fs::exists(a_ + ".v1.backup"));
}

TEST_F(Merging, StoppedItLeavesNothing) {
  make(a_, "P1", 1);
  EXPECT_THROW(
      merge(out_, {a_}, [](std::int64_t, std::int64_t) { throw std::runtime_error("stopped"); }),
      std::runtime_error);
  EXPECT_FALSE(fs::exists(out_));
  expect_no_drafts();
}

}  // namespace
}  // namespace palpate::data
