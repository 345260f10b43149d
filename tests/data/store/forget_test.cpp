// Withdrawal: after it, nothing of the participant is in any byte of the database or its backups.

#include <crypt.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <bit>
#include <chrono>
#include <random>
#include <thread>
#include <tuple>

#include "data/merge/merge.h"
#include "data/store/export_log.h"
#include "data/store/schema.h"
#include "data/store/store.h"
#include "data/store/tombstones.h"
#include "tests/data/store/child_process.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

constexpr const char* kGone = "WITHDRAWNPARTICIPANT7";
constexpr const char* kStays = "REMAININGPARTICIPANT2";
constexpr double kPose = 0.12345678901234567;

/// As SQLite stores a number.
std::string bytes_of(double number) {
  const auto pattern = std::bit_cast<std::uint64_t>(number);
  std::string bytes;
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(pattern >> shift);
  return bytes;
}

void show_session(Store& store, const std::string& code, double pose, int trials) {
  const Participant person = store.enrol(a_protocol(), code);
  RunInfo info = a_run();
  info.device_calibration = "calibrated by " + code;
  const palpate::data::Run run = store.begin_run(person, info);
  for (int trial = 1; trial <= trials; ++trial) {
    TrialRecord record = a_record(trial);
    record.orientation_wxyz[1] = pose;
    record.samples.resize(200);
    for (std::uint32_t i = 0; i < 200; ++i) record.samples[i].tip[0] = pose * i;
    record.attempt = store.begin_attempt(run, record, 1);
    store.finish_attempt(run, record);
  }
  store.begin_attempt(run, a_plan(trials + 1), 1);
  store.cut_off_attempt(run, "fault while " + code + " was there");
  store.add_note(run, 1, code + " felt fine");
  store.end_run(run, RunEnd::done, 1);
}

class Forgetting : public ::testing::Test {
 protected:
  Forgetting() {
    Store store = open();
    show_session(store, kGone, kPose, 30);
    show_session(store, kStays, 0.5, 30);
  }
  Store open() { return Store::open(path_, Store::Mode::write_or_create); }
  /// Files of the folder that hold these bytes.
  std::string holders_of(const std::string& bytes) {
    std::string all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      if (contains(contents_of(entry.path()), bytes)) all += entry.path().filename().string() + " ";
    }
    return all;
  }
  void expect_gone() {
    EXPECT_EQ(holders_of(kGone), "");
    EXPECT_EQ(holders_of(bytes_of(kPose)), "");
    EXPECT_EQ(holders_of(kStays), "study.db ");
  }
  /// With the log and the shared memory of a store that is open.
  void expect_gone_while_open() {
    EXPECT_EQ(holders_of(kGone), "");
    EXPECT_EQ(holders_of(bytes_of(kPose)), "");
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

TEST_F(Forgetting, LeavesNoByteBehindAndTheOthersAsTheyWere) {
  ASSERT_EQ(holders_of(kGone), "study.db ");
  ASSERT_EQ(holders_of(bytes_of(kPose)), "study.db ");
  {
    Store store = open();
    const ParticipantSummary before = store.participant_summary(kGone);
    EXPECT_EQ(before.protocols, 1);
    EXPECT_EQ(before.sessions, 1);
    EXPECT_EQ(before.trials, 30);
    EXPECT_EQ(before.cut_off, 1);
    EXPECT_FALSE(before.withdrawn_before);
    store.forget(kGone);
    expect_gone_while_open();
    const ParticipantSummary after = store.participant_summary(kGone);
    EXPECT_TRUE(after.withdrawn_before);
    EXPECT_EQ(after.protocols, 0);
    EXPECT_EQ(store.counts().participants, 1);
    EXPECT_EQ(store.counts().completed, 30);
    EXPECT_EQ(store.counts().cut_off, 1);
    EXPECT_EQ(store.notes().size(), 1u);
    std::size_t samples = 0;
    store.for_each_trial([&](const StoredTrial& trial) { samples += trial.record.samples.size(); },
                         true);
    EXPECT_EQ(samples, 6000u);
  }
  expect_gone();
}

TEST_F(Forgetting, TheCodeIsNotGivenAgain) {
  Store store = open();
  store.forget(kGone);
  EXPECT_TRUE(contains(error_of([&] { store.enrol(a_protocol(), kGone); }), "has withdrawn"));
  EXPECT_TRUE(contains(error_of([&] { store.enrol(a_protocol('b'), kGone); }), "has withdrawn"))
      << "nor in another protocol";
  EXPECT_EQ(store.enrol(a_protocol(), "WITHDRAWNPARTICIPANT8").number, 1)
      << "the number is free: the counterbalancing has no gap";
  store.forget("WITHDRAWNPARTICIPANT8");
  EXPECT_TRUE(contains(error_of([&] { store.enrol(a_protocol(), kGone); }), "has withdrawn"));
  EXPECT_TRUE(
      contains(error_of([&] { store.enrol(a_protocol(), "WITHDRAWNPARTICIPANT8"); }), "withdrawn"));
}

TEST_F(Forgetting, WhoIsNotThereIsRefused) {
  Store store = open();
  EXPECT_TRUE(contains(error_of([&] { store.forget("P99"); }), "no participant P99"));
  EXPECT_TRUE(contains(error_of([&] { store.forget("P' OR 1"); }), "no participant's code"));
  EXPECT_EQ(store.counts().participants, 2);
  Store reader = Store::open(path_, Store::Mode::read_only);
  EXPECT_TRUE(contains(error_of([&] { reader.forget(kGone); }), "for reading only"));
}

TEST_F(Forgetting, DeletesTheBackupsThatHoldTheParticipant) {
  fs::copy_file(path_, path_ + ".v1.backup");
  fs::copy_file(path_, path_ + ".v1-2.backup");
  write_file(folder_ / "other.db.v1.backup", "another study's");
  {
    Store other = Store::open(path_ + ".v1-3.backup", Store::Mode::write_or_create);
    other.enrol(a_protocol(), "SOMEBODYELSE");
  }
  {
    Store store = open();
    const Withdrawal done = store.forget(kGone);
    EXPECT_EQ(done.backups_removed,
              (std::vector<std::string>{path_ + ".v1-2.backup", path_ + ".v1.backup"}));
    EXPECT_TRUE(done.backups_left.empty());
  }
  EXPECT_TRUE(fs::exists(path_ + ".v1-3.backup"));
  EXPECT_TRUE(fs::exists(folder_ / "other.db.v1.backup"));
  expect_gone();
}

TEST_F(Forgetting, DraftsOfKilledExportsGoAndOthersFilesStay) {
  const std::string draft = folder_ / ".trials.csv.palpate-Ab3-_9",
                    dataset = folder_ / ".bids.palpate-XyZ012";
  write_file(draft, "P01,1\n");
  fs::create_directory(dataset);
  write_file(dataset + "/participants.tsv", "P01\n");
  const std::string others[] = {folder_ / "trials.csv.palpate-Ab3-_9", folder_ / ".palpate-Ab3-_9",
                                folder_ / ".trials.csv.palpate-long-name", folder_ / "poetry.lock"};
  for (const std::string& other : others) write_file(other, "P01\n");
  {
    Store store = open();
    store.forget(kGone);
  }
  EXPECT_FALSE(fs::exists(draft));
  EXPECT_FALSE(fs::exists(dataset));
  for (const std::string& other : others) EXPECT_TRUE(fs::exists(other)) << other;
}

TEST_F(Forgetting, ABackupThatCannotBeReadIsNamed) {
  write_file(path_ + ".v1.backup", "not a database");
  Store store = open();
  EXPECT_EQ(store.forget(kGone).backups_left, std::vector<std::string>{path_ + ".v1.backup"});
  EXPECT_TRUE(fs::exists(path_ + ".v1.backup"));
  fs::remove(path_ + ".v1.backup");
  EXPECT_TRUE(store.forget(kGone).backups_left.empty());
}

TEST_F(Forgetting, ListsTheExportsThatHoldTheParticipantAlsoAfterwards) {
  Store store = open();
  const auto people = store.participants(a_protocol().sha256);
  ASSERT_EQ(people[0].code, kGone);
  log_export(path_, {folder_ / "both.csv", "csv", 1}, {people[0].id, people[1].id});
  log_export(path_, {folder_ / "one", "bids", 2}, {people[1].id});
  log_export(path_, {folder_ / (std::string(kGone) + ".csv"), "csv", 3}, {people[0].id});
  ASSERT_EQ(store.participant_summary(kGone).exports.size(), 2u);
  EXPECT_EQ(store.participant_summary(kGone).exports[0].path, "both.csv");
  EXPECT_EQ(store.participant_summary(kGone).exports[0].format, "csv");
  EXPECT_EQ(store.participant_summary(kGone).exports[0].made_utc_ns, 1);
  EXPECT_EQ(store.participant_summary(kStays).exports.size(), 2u);
  store.forget(kGone);
  const auto exports = store.participant_summary(kGone).exports;
  ASSERT_EQ(exports.size(), 2u);
  EXPECT_EQ(exports[0].path, "both.csv");
  EXPECT_EQ(exports[1].path, "....csv (export 3)") << "the path said the code";
  expect_gone_while_open();
  log_export(path_, {folder_ / "both.csv", "csv", 4}, {people[1].id});
  EXPECT_EQ(store.participant_summary(kGone).exports.size(), 1u)
      << "it was made anew without the participant";
}

TEST_F(Forgetting, ExportsAreOnRecordWithoutTheFoldersOfTheComputer) {
  Store store = open();
  const auto people = store.participants(a_protocol().sha256);
  const TemporaryFolder other, third;
  log_export(path_, {folder_ / "sub/study-bids/", "bids", 1}, {people[0].id});
  log_export(path_, {other / "trials.csv", "csv", 2}, {people[0].id});
  log_export(path_, {third / "trials.csv", "csv", 3}, {people[0].id});
  log_export(path_, {other / "trials.csv", "csv", 4}, {people[0].id});
  {  // as earlier versions kept it
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    db.exec("UPDATE exports SET path = '" + folder_ / "sub/study-bids" + "' WHERE format = 'bids'");
  }
  log_export(path_, {folder_ / "last.csv", "csv", 5}, {people[0].id});
  const auto exports = store.participant_summary(kGone).exports;
  ASSERT_EQ(exports.size(), 4u);
  EXPECT_EQ(exports[0].path, "sub/study-bids");
  EXPECT_TRUE(exports[1].path.starts_with("trials.csv (elsewhere, ")) << exports[1].path;
  EXPECT_TRUE(exports[2].path.starts_with("trials.csv (elsewhere, ")) << exports[2].path;
  EXPECT_NE(exports[1].path, exports[2].path);
  EXPECT_EQ(exports[2].made_utc_ns, 4) << "the same place again";
  EXPECT_EQ(exports[3].path, "last.csv");
}

TEST_F(Forgetting, AnExportMadeMeanwhileIsRefused) {
  Store store = open();
  const auto people = store.participants(a_protocol().sha256);
  store.forget(kGone);
  EXPECT_TRUE(
      contains(error_of([&] {
                 log_export(path_, {folder_ / "late.csv", "csv", 1}, {people[1].id, people[0].id});
               }),
               "was withdrawn while"));
  EXPECT_TRUE(store.participant_summary(kStays).exports.empty());
}

TEST_F(Forgetting, CountsNotesOnOthersThatSayTheCode) {
  Store store = open();
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "P3"), a_run());
  for (const char* text : {"came with P7", "P7x", "xP7", "(P7)", "P77"}) {
    store.add_note(run, 1, text);
  }
  EXPECT_EQ(store.participant_summary("P7").mentions, 2);
}

TEST_F(Forgetting, AReaderThatHoldsTheLogIsNamedAndTheSameCallFinishes) {
  {
    Store store = open();
    Store reader = Store::open(path_, Store::Mode::read_only);
    store.add_note(store.begin_run(store.enrol(a_protocol(), "P3"), a_run()), 1, "log");
    EXPECT_TRUE(contains(error_of([&] { store.forget(kGone); }), "another program that reads"));
  }
  open().forget(kGone);
  expect_gone();
}

TEST_F(Forgetting, KilledAtAnyMomentItIsAllThereOrTheSameCallFinishes) {
  const std::string original = contents_of(path_);
  std::mt19937 random(7);
  // Killed sooner or later by what came of it, so that a slow or busy machine sees both as well.
  double longest_us = 45'000;
  int all_there = 0, finished = 0;
  for (int round = 0; round < 40; ++round) {
    for (const auto& entry : fs::directory_iterator(folder_.path())) fs::remove(entry.path());
    write_file(path_, original);
    write_file(path_ + ".v1.backup", original);
    {
      ChildProcess child({"forget", path_, kGone});
      ASSERT_EQ(child.read_line(), "open");
      std::this_thread::sleep_for(
          std::chrono::microseconds(random() % static_cast<unsigned>(longest_us)));
      child.kill();
    }
    Store store = open();
    const ParticipantSummary now = store.participant_summary(kGone);
    if (now.protocols == 1) {
      ++all_there;
      longest_us *= 1.2;
      EXPECT_FALSE(now.withdrawn_before);
      EXPECT_EQ(now.trials, 30);
      EXPECT_EQ(store.counts().completed, 60);
    } else {
      ++finished;
      longest_us /= 1.2;
      EXPECT_TRUE(now.withdrawn_before);
      EXPECT_EQ(store.counts().completed, 30);
    }
    store.forget(kGone);
    EXPECT_EQ(holders_of(kGone), "");
    EXPECT_EQ(holders_of(bytes_of(kPose)), "");
  }
  EXPECT_GT(all_there, 0);
  EXPECT_GT(finished, 0);
}

TEST(TombstonesOf, ADatabaseCannotBeGuessedWithoutItsSecret) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), "P07");
    store.enrol(a_protocol(), "P08");
    store.forget("P07");
    store.forget("P08");
  }
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  EXPECT_EQ(db.execAndGet("SELECT count(*) FROM tombstone_secrets").getInt(), 1);
  EXPECT_TRUE(Tombstones::read(db, path).holds("P07"));
  EXPECT_FALSE(Tombstones::read(db, path).holds("P09"));
  db.exec("UPDATE tombstone_secrets SET secret = randomblob(32)");
  EXPECT_FALSE(Tombstones::read(db, path).holds("P07"));
}

TEST(TombstonesOf, SeveralStationsAreAllHonouredByAMergeAndByMergesOfIt) {
  const TemporaryFolder folder;
  const std::string a = folder / "a.db", b = folder / "b.db", c = folder / "c.db";
  for (const auto& [path, gone, number] : {std::tuple(a, "P1", 1), std::tuple(b, "P2", 2)}) {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), gone, number);
    store.forget(gone);
  }
  {
    Store store = Store::open(c, Store::Mode::write_or_create);
    for (const char* code : {"P1", "P2", "P3"}) store.enrol(a_protocol(), code);
  }
  merge(folder / "ab.db", {a, b});
  const MergeResult done = merge(folder / "all.db", {folder / "ab.db", c});
  EXPECT_EQ(done.excluded.size(), 2u);
  EXPECT_EQ(done.counts.participants, 1);
  Store all = Store::open(folder / "all.db", Store::Mode::write_or_create);
  for (const char* code : {"P1", "P2"}) {
    EXPECT_THROW(all.enrol(a_protocol(), code), StoreRefused) << code;
  }
}

TEST(TombstonesOf, OneWithoutASecretGetsItWhenTheCodeIsForgottenAgain) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), "P1");
    store.forget("P1");
  }
  std::string unkeyed;
  {
    SQLite::Database db(path, SQLite::OPEN_READWRITE);
    const std::string salt =
        db.execAndGet("SELECT substr(code_hash, 1, 29) FROM tombstones").getString();
    unkeyed = crypt("P1", salt.c_str());
    db.exec("UPDATE tombstones SET secret_id = NULL, code_hash = '" + unkeyed + "'");
    EXPECT_TRUE(Tombstones::read(db, path).holds("P1"));
  }
  Store::open(path, Store::Mode::write_or_create).forget("P1");
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  EXPECT_TRUE(Tombstones::read(db, path).holds("P1"));
  EXPECT_EQ(db.execAndGet("SELECT count(*) FROM tombstones WHERE secret_id IS NULL").getInt(), 0);
  EXPECT_NE(db.execAndGet("SELECT code_hash FROM tombstones").getString(), unkeyed);
}

TEST(Traces, CopiesTablesAndReportsBesideTheDatabaseAreNamed) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), "P07");
  }
  std::filesystem::copy_file(path, folder / "s.db.bak");
  Store::open(folder / "other.db", Store::Mode::write_or_create).enrol(a_protocol(), "P08");
  write_file(folder / "trials.csv", "participant_id\r\nP07\r\n");
  write_file(folder / "report.html", "<td>P07</td>");
  write_file(folder / "unrelated.txt", "P070, XP07");
  std::filesystem::create_directories(folder / "bids/sub-P07");
  EXPECT_EQ(Store::open(path, Store::Mode::write_or_create).participant_summary("P07").elsewhere,
            (std::vector<std::string>{folder / "bids", folder / "report.html", folder / "s.db.bak",
                                      folder / "trials.csv"}));
}

}  // namespace
}  // namespace palpate::data
