// Withdrawal: afterwards no byte of the participant is in the database or its backups.

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdint>
#include <random>
#include <thread>
#include <tuple>

#include "data/store/schema.h"
#include "data/store/store.h"
#include "tests/data/store/child_process.h"
#include "tests/data/store/forget_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

TEST_F(Forgetting, LeavesNoByteBehindAndOthersUntouched) {
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

TEST_F(Forgetting, TheCodeCannotBeUsedAgain) {
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

TEST_F(Forgetting, AnUnknownParticipantIsRefused) {
  Store store = open();
  EXPECT_TRUE(contains(error_of([&] { store.forget("P99"); }), "no participant P99"));
  EXPECT_TRUE(contains(error_of([&] { store.forget("P' OR 1"); }), "is not a participant code"));
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

TEST_F(Forgetting, RemovesOnlyTemporaryFilesOfKilledExports) {
  const std::string temporary = folder_ / ".trials.csv.palpate-Ab3-_9",
                    dataset = folder_ / ".bids.palpate-XyZ012";
  write_file(temporary, "P01,1\n");
  fs::create_directory(dataset);
  write_file(dataset + "/participants.tsv", "P01\n");
  const std::string others[] = {folder_ / "trials.csv.palpate-Ab3-_9", folder_ / ".palpate-Ab3-_9",
                                folder_ / ".trials.csv.palpate-long-name", folder_ / "poetry.lock"};
  for (const std::string& other : others) write_file(other, "P01\n");
  {
    Store store = open();
    store.forget(kGone);
  }
  EXPECT_FALSE(fs::exists(temporary));
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

TEST_F(Forgetting, CountsNotesOnOthersThatSayTheCode) {
  Store store = open();
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "P3"), a_run());
  for (const char* text : {"came with P7", "P7x", "xP7", "(P7)", "P77"}) {
    store.add_note(run, 1, text);
  }
  EXPECT_EQ(store.participant_summary("P7").mentions, 2);
}

TEST_F(Forgetting, FinishesLaterIfAReaderKeepsTheWal) {
  {
    Store store = open();
    Store reader = Store::open(path_, Store::Mode::read_only);
    store.add_note(store.begin_run(store.enrol(a_protocol(), "P3"), a_run()), 1, "log");
    EXPECT_TRUE(contains(error_of([&] { store.forget(kGone); }), "another program reads"));
  }
  open().forget(kGone);
  expect_gone();
}

TEST_F(Forgetting, KilledAtAnyMomentTheSameCallFinishes) {
  const std::string original = contents_of(path_);
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 random(kSeed);
  // The next kill comes sooner or later depending on the outcome, so that slow machines see both
  // outcomes.
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

}  // namespace
}  // namespace palpate::data
