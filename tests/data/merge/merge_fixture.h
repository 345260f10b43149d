#pragma once
// Databases of two stations, and the expected result of their merge.

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "data/export/csv.h"
#include "data/merge/merge.h"
#include "tests/data/store/seal_again.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data::testing {

using Lines = std::multiset<std::string>;

inline Store open_station(const std::string& path) {
  return Store::open(path, Store::Mode::write_or_create);
}

inline constexpr std::int64_t kDay = 86'400'000'000'000;

/// One live session with every kind of row: two runs, a note, an attempt that was cut off, samples.
inline void record_session(Store& store, const std::string& code, std::optional<int> number = {},
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

inline void make_station(const std::string& path, const std::string& code, int number) {
  Store store = open_station(path);
  record_session(store, code, number);
}

/// A version as if recorded in the database.
inline void record_otherwise(const std::string& path, const std::string& sql) {
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  db.exec(sql);
  seal_again(db);
}

/// Every line of a CSV export but the header, and of the attempts beside it.
inline Lines exported(const std::string& database, const TemporaryFolder& folder) {
  Store store = Store::open(database, Store::Mode::read_only);
  export_csv(store, folder / "t.csv", true);
  Lines lines;
  for (const char* name : {"t.csv", "t_attempts.csv"}) {
    std::ifstream in(folder / name);
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) lines.insert(std::string(name) + ": " + line);
    std::filesystem::remove(folder / name);
  }
  return lines;
}

/// Notes, runs and samples, which a CSV export lacks.
inline Lines notes_runs_and_samples(const std::string& database) {
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
    EXPECT_FALSE(std::filesystem::exists(out_));
    expect_no_temporaries();
    return message;
  }
  std::string refusal_while_locked(const std::vector<std::string>& inputs) {
    const std::string message = error_of([&] { merge(out_, inputs); });
    EXPECT_FALSE(std::filesystem::exists(out_));
    return message;
  }
  void expect_no_temporaries() {
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      EXPECT_FALSE(contains(entry.path().filename().string(), ".palpate-")) << entry.path();
    }
  }
  const TemporaryFolder folder_, export_folder_;
  const std::string a_ = folder_ / "a.db", b_ = folder_ / "b.db", out_ = folder_ / "all.db";
};

}  // namespace palpate::data::testing
