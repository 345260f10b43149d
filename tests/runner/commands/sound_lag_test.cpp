// A session is refused if contacts are heard later than people are sure to miss.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "runner/station/lag_check.h"
#include "runner/station/sound_timing.h"
#include "runner/usage_error.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::runner::station {
namespace {

protocols::Protocol heard(const std::string& sounds) {
  return protocols::parse_protocol_text(
      R"({"version": 2, "name": "s", "renderers": ["point"], "sounds": )" + sounds +
          R"(, "stimuli": [{"name": "a", "shape": "cube", "edge_m": 0.05, "sound": {"kind": "modal",
      "modes": [{"frequency_hz": 500, "decay_per_s": 50}]}}],
      "blocks": [{"name": "b", "task": "rate", "stimuli": ["a"], "repetitions": 1}]})",
      "s.json");
}

/// A session with a trial whose knocks were so late. \param lag  s
void add_heard_session(data::Store& store, int session, double lag) {
  data::RunInfo info = data::testing::a_run(session);
  info.clock.utc_ns += session * 1'000'000'000LL;
  const data::Run run = store.begin_run(store.enrol(data::testing::a_protocol(), "P1"), info);
  data::TrialRecord record = data::testing::a_record(1, session);
  record.task.task = "rate";
  record.task.block_name = "b";
  record.attempt = store.begin_attempt(run, record, record.onset_ns - 1);
  record.task.intervals = {{}};
  record.task.heard = {3, lag};
  store.finish_attempt(run, record);
}

class SoundLag : public ::testing::Test {
 protected:
  std::string check(const std::string& sounds = "{}") {
    return check_sound_lag(store_, heard(sounds), settings_);
  }
  const palpate::testing::TemporaryFolder folder_;
  data::Store store_ = data::Store::open(folder_ / "s.db", data::Store::Mode::write_or_create);
  RunSettings settings_;
};

TEST_F(SoundLag, NewestSessionDecidesWhereNothingWasMeasured) {
  EXPECT_EQ(check(), "");
  add_heard_session(store_, 1, 0.0032);
  EXPECT_EQ(check(), "");
  add_heard_session(store_, 2, 0.02);
  EXPECT_THROW(check(), UsageError);
  EXPECT_EQ(check(R"({"lag": "accepted"})"), R"({"sound_lag_accepted_s":0.02})");
  settings_.without_noise = true;
  EXPECT_EQ(check(), "");
}

TEST_F(SoundLag, AMeasurementOfTheSameDeviceComesFirst) {
  settings_.calibration = folder_ / "lab.json";
  settings_.sound_device = "plughw:1";
  const std::string path = sound_timing_file(settings_.calibration);
  EXPECT_EQ(path, folder_ / "lab.sound.json");
  add_heard_session(store_, 1, 0.0032);
  store_sound_timing(path, {"plughw:2", "plughw:1", 200, 0, 0.03, 0.031, "2026-01-01T00:00:00Z"});
  EXPECT_EQ(check(), "");
  store_sound_timing(path, {"plughw:1", "plughw:1", 200, 1, 0.03, 0.031, "2026-01-01T00:00:00Z"});
  EXPECT_THROW(check(), UsageError);
  EXPECT_EQ(check(R"({"lag": "accepted"})"), R"({"sound_lag_accepted_s":0.03})");
  store_sound_timing(path, {"plughw:1", "plughw:1", 200, 1, 0.01, 0.012, "2026-01-02T00:00:00Z"});
  EXPECT_EQ(check(), "");
  ASSERT_EQ(stored_sound_timings(path).size(), 2u);
  EXPECT_EQ(stored_sound_timings(path)[1].missed, 1);
}

TEST_F(SoundLag, RefusesAFileThatWasChanged) {
  const std::string path = folder_ / "lab.sound.json";
  store_sound_timing(path, {"plughw:1", "plughw:1", 200, 0, 0.03, 0.031, "2026-01-01T00:00:00Z"});
  std::string text = protocols::read_text_file(path);
  text.replace(text.find("0.03,"), 5, "0.01,");
  std::ofstream(path) << text;
  EXPECT_THROW(stored_sound_timings(path), protocols::InputError);
  std::ofstream(path) << "{}";
  EXPECT_THROW(store_sound_timing(path, {"plughw:1", "in", 200, 0, 0.03, 0.031, ""}),
               protocols::InputError);
  EXPECT_EQ(protocols::read_text_file(path), "{}") << "nothing is overwritten";
}

}  // namespace
}  // namespace palpate::runner::station
