#pragma once
// A database with two participants, one of whom withdraws.

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <string>

#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data::testing {

inline constexpr const char* kGone = "WITHDRAWNPARTICIPANT7";
inline constexpr const char* kStays = "REMAININGPARTICIPANT2";
inline constexpr double kPose = 0.12345678901234567;

/// As SQLite stores a number.
inline std::string bytes_of(double number) {
  const auto pattern = std::bit_cast<std::uint64_t>(number);
  std::string bytes;
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(pattern >> shift);
  return bytes;
}

inline void record_withdrawing_session(Store& store, const std::string& code, double pose,
                                       int trials) {
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
    record_withdrawing_session(store, kGone, kPose, 30);
    record_withdrawing_session(store, kStays, 0.5, 30);
  }
  Store open() { return Store::open(path_, Store::Mode::write_or_create); }
  /// Files of the folder that hold these bytes.
  std::string holders_of(const std::string& bytes) {
    std::string all;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
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

}  // namespace palpate::data::testing
