// Trials and servo timing read from a database.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "analysis/input/study_record.h"
#include "analysis/input/study_table.h"
#include "analysis/input/trials.h"
#include "data/base/checksum.h"
#include "data/store/store.h"
#include "data/store/task_text.h"
#include "protocols/parse.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::analysis {
namespace {

class TrialsStore : public ::testing::Test {
 protected:
  static data::TrialRecord trial(int number, const std::string& renderer, const std::string& shape,
                                 const std::string& response) {
    data::TrialRecord record;
    record.trial = number;
    record.renderer = renderer;
    record.shape = shape;
    record.response = response;
    record.correct = shape == response;
    record.timed_out = response.empty();
    record.response_time = response.empty() ? 60 : 1.5 * number;
    record.onset_ns = number * 100'000'000'000LL;
    record.response_ns = record.onset_ns + static_cast<std::int64_t>(record.response_time * 1e9);
    return record;
  }
  /// Stimuli are in the order of the protocol, not of their first appearance.
  void study(const std::vector<data::TrialRecord>& records,
             const std::string& text =
                 R"({"stimuli": [{"name": "wedge"}, {"name": "cube"}, {"name": "torus"}]})",
             const std::string& note = "") {
    data::Store store = data::Store::open(path_, data::Store::Mode::write_or_create);
    const data::ProtocolInfo protocol{"test", text, checksum_hex(text)};
    const data::Participant participant = store.enrol(protocol, "S1", 1, true, 7);
    data::RunInfo info;
    info.program_version = "9.9.9";
    info.build = "test";
    info.device = "simulated";
    info.response_device = "simulated";
    info.observer_sha256 = std::string(64, 'b');
    const palpate::data::Run run = store.begin_run(participant, info);
    if (!note.empty()) store.add_note(run, 0, note);
    store.record_simulated(run, records);
    store.end_run(run, data::RunEnd::done, 1'000'000'000'000LL);
  }

  const palpate::testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

TEST_F(TrialsStore, ReadsCompletedTrials) {
  auto practice = trial(1, "ray", "cube", "cube");
  practice.practice = true;
  study({practice, trial(2, "ray", "torus", "torus"), trial(3, "point", "wedge", ""),
         trial(4, "point", "cube", "wedge")});
  data::Store store = data::Store::open(path_, data::Store::Mode::read_only);
  const TrialTable table = read_trials_store(store);
  EXPECT_EQ(table.participants, (std::vector<std::string>{"S1"}));
  EXPECT_EQ(table.renderers, (std::vector<std::string>{"point", "ray"}));
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"cube", "wedge", "torus"}));
  EXPECT_EQ(table.n_practice, 1U);
  EXPECT_EQ(table.simulated, Simulated::yes);
  ASSERT_EQ(table.rows.size(), 3U);
  EXPECT_EQ(table.rows[0].shape, 2);
  EXPECT_EQ(table.rows[0].renderer, 1);
  EXPECT_TRUE(table.rows[0].correct);
  EXPECT_EQ(table.rows[0].response_time, 3.0);
  EXPECT_TRUE(table.rows[1].timed_out);
  EXPECT_EQ(table.rows[1].answer, -1);
  EXPECT_EQ(table.rows[2].answer, 1);
  EXPECT_EQ(table.provenance.protocol_name, "test");
  EXPECT_EQ(table.provenance.protocol_sha256,
            (std::vector<std::string>{checksum_hex(
                R"({"stimuli": [{"name": "wedge"}, {"name": "cube"}, {"name": "torus"}]})")}));
  EXPECT_EQ(table.provenance.observer_sha256, std::string(64, 'b'));
  EXPECT_EQ(table.provenance.program_versions, (std::vector<std::string>{"9.9.9"}));
}

TEST_F(TrialsStore, CountsTrialsWhoseTorqueWasLeftOut) {
  study({trial(1, "ray", "torus", "torus"), trial(2, "ray", "cube", "cube"),
         trial(3, "point", "wedge", "wedge")},
        "{}", data::kTorqueLeftOutNote);
  data::Store store = data::Store::open(path_, data::Store::Mode::read_only);
  EXPECT_EQ(read_trials_store(store).warnings,
            (std::vector<std::string>{
                "In 2 of 2 trials with ray torque was left out: the device drives force alone."}));
  EXPECT_EQ(read_study_store(store).times->warnings, read_trials_store(store).warnings);
}

TEST_F(TrialsStore, RecordsEachRenderersServoWithoutPractice) {
  auto first = trial(1, "ray", "cube", "cube"), second = trial(2, "ray", "cube", "cube"),
       third = trial(3, "ray", "cube", "cube"), point = trial(4, "point", "cube", "cube"),
       practice = trial(5, "ray", "cube", "cube");
  first.ticks = 1000;
  first.missed_ticks = 2;
  first.longest_period_ns = 1'000'000;
  first.max_force = 1.5;
  second.ticks = 500;
  second.longest_period_ns = 3'000'000;
  second.faults = 4;
  second.max_force = 2.5;
  second.started_inside = true;
  third.ticks = 10;
  third.missed_ticks = 1;
  third.longest_period_ns = 1'000'000;
  third.max_force = 0.5;
  point.ticks = 7;
  practice.practice = true;
  practice.ticks = 9999;
  study({first, second, third, point, practice},
        R"({"title": "A study", "seed": 18446744073709551615, "stimuli": []})");
  data::Store store = data::Store::open(path_, data::Store::Mode::read_only);
  const StudyRecord record = read_study_record(store);
  ASSERT_EQ(record.servo.size(), 2U);
  EXPECT_EQ(record.servo[0].renderer, "point");
  EXPECT_EQ(record.servo[0].ticks, 7U);
  EXPECT_EQ(record.servo[0].longest_period, 0) << "no period is known";
  const ServoQuality& ray = record.servo[1];
  EXPECT_EQ(ray.renderer, "ray");
  EXPECT_EQ(ray.n_trials, 3U);
  EXPECT_EQ(ray.n_with_missed, 2U);
  EXPECT_EQ(ray.n_with_faults, 1U);
  EXPECT_EQ(ray.n_started_inside, 1U);
  EXPECT_EQ(ray.ticks, 1510U);
  EXPECT_EQ(ray.missed_ticks, 3U);
  EXPECT_NEAR(ray.longest_period, 0.003, 1e-15);
  EXPECT_EQ(ray.max_force, 2.5);
  // 20 bins a decade from 0.1 ms on: 1 ms begins bin 20, 3 ms is in bin 29 (20 lg 30 = 29.5).
  for (std::size_t bin = 0; bin < ray.longest_periods.size(); ++bin) {
    EXPECT_EQ(ray.longest_periods[bin], bin == 20 ? 2U : bin == 29 ? 1U : 0U) << bin;
  }
  ASSERT_EQ(record.protocols.size(), 1U);
  EXPECT_EQ(record.protocols[0].name, "test");
  EXPECT_EQ(record.protocols[0].title, "A study");
  EXPECT_EQ(record.protocols[0].seed, "18446744073709551615") << "as it is written";
  EXPECT_EQ(record.devices, std::vector<std::string>{"simulated"});
  EXPECT_EQ(record.builds, std::vector<std::string>{"test"});
  EXPECT_EQ(record.response_devices, std::vector<std::string>{"simulated"});
  EXPECT_EQ(record.seeds, std::vector<std::string>{"S1: 7"});
  EXPECT_EQ(record.n_cut_off, 0U);
}

TEST_F(TrialsStore, PeriodsBeyondTheBinsCountInTheLast) {
  auto shortest = trial(1, "ray", "cube", "cube"), longest = trial(2, "ray", "cube", "cube");
  shortest.longest_period_ns = 10;
  longest.longest_period_ns = 3'600'000'000'000;  // an hour
  study({shortest, longest}, "{}");
  data::Store store = data::Store::open(path_, data::Store::Mode::read_only);
  const StudyRecord record = read_study_record(store);
  EXPECT_EQ(record.servo[0].longest_periods.front(), 1U);
  EXPECT_EQ(record.servo[0].longest_periods.back(), 1U);
  EXPECT_EQ(record.protocols[0].title, "");
  EXPECT_EQ(record.protocols[0].seed, "");
}

TEST_F(TrialsStore, PracticeAloneIsNothingToAnalyse) {
  auto practice = trial(1, "ray", "cube", "cube");
  practice.practice = true;
  study({practice});
  data::Store store = data::Store::open(path_, data::Store::Mode::read_only);
  EXPECT_THROW(read_trials_store(store), protocols::InputError);
}

}  // namespace
}  // namespace palpate::analysis
