// A writing process is killed at any moment: acknowledged trials are there, and begun ones are on
// record.

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <random>
#include <sstream>
#include <thread>

#include "data/export/csv.h"
#include "data/store/store.h"
#include "tests/data/store/child_process.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

/// Output of the lives of a process.
struct Said {
  int runs = 0;
  int acknowledged = 0;         ///< the last trial
  std::map<int, int> attempts;  ///< trial -> latest attempt
};

/// End of a life: a number of lines after its start, plus a moment. Counting lines makes slow
/// machines get as far as fast ones.
struct Death {
  unsigned lines = 0, microseconds = 0;
};

Death a_death(std::mt19937& random) {
  // Without a line to wait for, it dies while the file is created or opened.
  const unsigned lines = random() % 4 == 0 ? 0 : 1 + random() % 10;
  return {lines, static_cast<unsigned>(random() % (lines == 0 ? 20'000 : 8'000))};
}

/// One life, killed unless it ends by itself. \return whether it was killed.
bool live_once(const std::vector<std::string>& arguments, const Death& death, Said& said) {
  ChildProcess child(arguments);
  std::vector<std::string> lines;
  while (lines.size() < death.lines) {
    lines.push_back(child.read_line());
    if (lines.back().empty()) break;
  }
  std::this_thread::sleep_for(std::chrono::microseconds(death.microseconds));
  child.kill();
  const int status = child.wait();
  for (const std::string& line : child.read_rest()) lines.push_back(line);
  for (const std::string& line : lines) {
    std::istringstream words(line);
    std::string word;
    int trial = 0, attempt = 0;
    words >> word >> trial >> attempt;
    if (word == "run") ++said.runs;
    if (word == "acknowledged") {
      EXPECT_GT(trial, said.acknowledged) << "trial " << trial << " was run again";
      said.acknowledged = trial;
    }
    if (word == "begun") {
      // Either the previous attempt was not acknowledged, or every earlier one is counted.
      EXPECT_GT(attempt, said.attempts[trial]) << "trial " << trial;
      said.attempts[trial] = attempt;
    }
  }
  EXPECT_TRUE(status == 0 || status == -SIGKILL) << status;
  return status == -SIGKILL;
}

/// Content of the file right after a death, before any repair.
void expect_nothing_lost(const std::string& path, const Said& said) {
  if (!std::filesystem::exists(path)) {
    EXPECT_EQ(said.runs, 0);
    return;
  }
  Store store = Store::open(path, Store::Mode::read_only);
  int completed = 0;
  store.for_each_trial([&](const StoredTrial& trial) {
    EXPECT_EQ(trial.record.trial, ++completed) << "resumed at the first trial without a record";
  });
  EXPECT_GE(completed, said.acknowledged) << "an acknowledged trial is lost";
}

TEST(Durability, SessionKilledAtAnyMomentResumesWithoutLoss) {
  constexpr int kTrials = 30;
  constexpr int kKills = 120;
  constexpr std::uint32_t kSeed = 2000;
  std::mt19937 random(kSeed);
  int kills = 0, databases = 0, cut_off_in_all = 0;
  while (kills < kKills) {
    const TemporaryFolder folder;
    const std::string path = folder / "study.db";
    ++databases;
    Said said;
    bool alive = true;
    int deaths = 0;
    while (alive) {
      alive = live_once({"session", path, std::to_string(kTrials), std::to_string(random())},
                        a_death(random), said);
      deaths += alive;
      expect_nothing_lost(path, said);
      if (::testing::Test::HasFailure()) return;
    }
    kills += deaths;

    Store store = Store::open(path, Store::Mode::read_only);
    std::map<int, int> attempts;
    store.for_each_cut_off([&](const StoredTrial& trial) {
      EXPECT_EQ(trial.record.attempt, ++attempts[trial.record.trial]);
      EXPECT_TRUE(contains(trial.cut_off_reason, "interrupted"));
    });
    for (const auto& [trial, count] : attempts) cut_off_in_all += count;
    store.for_each_trial(
        [&](const StoredTrial& trial) {
          const TrialRecord want = a_record(trial.record.trial);
          EXPECT_EQ(trial.record.attempt, ++attempts[trial.record.trial])
              << "the attempts before are on record";
          EXPECT_EQ(trial.record.response_time, want.response_time);
          EXPECT_EQ(trial.record.samples.size(),
                    static_cast<std::size_t>(trial.record.trial % 5) * 100);
        },
        true);
    for (const auto& [trial, attempt] : said.attempts)
      EXPECT_GE(attempts[trial], attempt) << "trial " << trial;
    const StoreCounts counts = store.counts();
    EXPECT_EQ(counts.completed, kTrials);
    // A death before begin_run returned left no run, or an unacknowledged one.
    EXPECT_GE(counts.runs, said.runs);
    EXPECT_LE(counts.runs, deaths + 1);
    const auto runs = store.runs();
    EXPECT_EQ(counts.interrupted_runs + (runs.back().end == RunEnd::done), counts.runs);
    SQLite::Database db(path);
    EXPECT_EQ(db.execAndGet("PRAGMA integrity_check").getString(), "ok");
    EXPECT_FALSE(SQLite::Statement(db, "PRAGMA foreign_key_check").executeStep());
  }
  EXPECT_GT(databases, 2);
  EXPECT_GT(cut_off_in_all, kKills / 10) << "the kills did not fall into trials";
  RecordProperty("kills", kills);
}

TEST(Durability, SimulationKilledAnytimeExportsTheSameBytes) {
  constexpr int kTrials = 100;
  const auto export_of = [](const std::string& path) {
    Store store = Store::open(path, Store::Mode::read_only);
    EXPECT_EQ(export_csv(store, path + ".csv", false).attempts, 0);
    return contents_of(path + ".csv");
  };
  const TemporaryFolder folder;
  const std::string whole = folder / "whole.db";
  EXPECT_EQ(ChildProcess({"simulate", whole, std::to_string(kTrials), "1"}).wait(), 0);
  const std::string expected = export_of(whole);
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 random(kSeed);
  int kills = 0;
  for (int database = 0; kills < 20; ++database) {
    const std::string path = folder / ("cut" + std::to_string(database) + ".db");
    Said said;
    while (live_once({"simulate", path, std::to_string(kTrials), "1"}, a_death(random), said)) {
      ++kills;
      expect_nothing_lost(path, said);
    }
    ASSERT_FALSE(HasFailure());
    ASSERT_EQ(export_of(path), expected);
  }
}

}  // namespace
}  // namespace palpate::data
