#pragma once
// Values that differ in every field, and a database in its own folder.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "data/base/checksum.h"
#include "data/store/store.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::data::testing {

using palpate::testing::TemporaryFolder;

/// \param variant  another letter, another text
inline ProtocolInfo a_protocol(char variant = 'a') {
  const std::string text =
      "{\"version\": 1}" + std::string(static_cast<std::size_t>(variant - 'a'), ' ') + "\n";
  return {.name = "ho2000", .text = text, .sha256 = checksum_hex(text)};
}

inline RunInfo a_run(int session = 1) {
  RunInfo info;
  info.session = session;
  info.clock = {.utc_ns = 1'700'000'000'123'456'789, .monotonic_ns = 5'000'000'000};
  info.program_version = "0.1.0";
  info.device = "falcon";
  return info;
}

/// The fields known before the trial is shown.
inline TrialRecord a_plan(int trial, int session = 1) {
  TrialRecord plan;
  plan.session = session;
  plan.block = 1 + trial / 10;
  plan.trial = trial;
  plan.renderer = "ray";
  plan.shape = "cube";
  plan.orientation_wxyz = {0.5, -0.5, 0.1 * trial, 1.0 / 3.0};
  return plan;
}

/// The fields known after it has ended.
inline TrialRecord a_record(int trial, int session = 1) {
  TrialRecord record = a_plan(trial, session);
  record.response = "cone";
  record.response_time = 1.1 * trial;
  record.first_contact_time = 0.7 * trial;
  record.onset_ns = 6'000'000'000 + trial * 20'000'000'000LL;
  record.response_ns = record.onset_ns + trial * 1'100'000'000LL;
  record.ticks = 1100u * static_cast<unsigned>(trial);
  record.longest_period_ns = 1'003'000;
  record.max_force = 3.25;
  return record;
}

inline std::string contents_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_file(const std::string& path, const std::string& contents) {
  std::ofstream(path, std::ios::binary) << contents;
}

/// The message of the StoreError that `work` throws; "" and a failure if it throws none.
template <class Work>
std::string error_of(Work&& work) {
  try {
    work();
  } catch (const StoreError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no StoreError";
  return "";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// A database in its own folder, and a live trial from its beginning to its record.
class StoreOnDisk : public ::testing::Test {
 protected:
  Store open() { return Store::open(path_, Store::Mode::write_or_create); }
  void show(Store& store, const palpate::data::Run& run, int trial) {
    TrialRecord record = a_record(trial, run.session);
    record.attempt = store.begin_attempt(run, record, record.onset_ns - 1);
    store.finish_attempt(run, record);
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

}  // namespace palpate::data::testing
