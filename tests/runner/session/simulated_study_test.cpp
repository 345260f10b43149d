// The same seed gives the same records, whatever the number of jobs and of interruptions.

#include "runner/session/simulated_study.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "data/export/csv.h"
#include "protocols/parse.h"
#include "stimuli/random.h"

namespace palpate::runner {
namespace {

namespace fs = std::filesystem;

class SimulatedStudy : public ::testing::Test {
 protected:
  SimulatedStudy() {
    std::string pattern = ::testing::TempDir() + "study-XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  ~SimulatedStudy() override { fs::remove_all(folder_); }

  /// Two short sessions for each participant, so that simulation of the whole takes a second.
  protocols::Protocol protocol(const std::string& more = "") const {
    return protocols::parse_protocol_text(
        R"({"version": 1, "name": "brief", "renderers": ["point", "ray"],
      "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2},
                  {"name": "cone", "shape": "cone", "radius_m": 0.03, "height_m": 0.06}],
      "repetitions": 3, "sessions": {"count": 2}, "practice": {"repetitions": 1, "criterion": 1, "max_rounds": 2},
      "breaks": {"every_trials": 4, "min_seconds": 5},
      "response": {"keys": {"1": "sphere", "2": "cone"}, "time_out_s": 9.0005}, "seed": 3)" +
            more + "}",
        "brief.json");
  }

  std::string csv_of(const fs::path& db) const {
    data::Store store = data::Store::open(db, data::Store::Mode::read_only);
    const fs::path csv = folder_ / "out.csv";
    data::export_csv(store, csv, true);
    EXPECT_FALSE(fs::exists(folder_ / "attempts.csv"))
        << "a simulated trial leaves no cut-off attempt";
    std::ifstream in(csv, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

  StudyProgress simulate(const protocols::Protocol& protocol, const fs::path& db, int jobs,
                         std::uint64_t seed = 1) const {
    data::Store store = data::Store::open(db, data::Store::Mode::write_or_create);
    const std::atomic<bool> never{false};
    return simulate_study(protocol, store, load_simulated_settings(""), {3, seed, jobs}, never, {});
  }

  fs::path folder_;
};

TEST_F(SimulatedStudy, IsTheSameForAnyNumberOfJobs) {
  const protocols::Protocol p = protocol();
  const StudyProgress progress = simulate(p, folder_ / "one.db", 1);
  EXPECT_EQ(progress.recorded, progress.expected);
  EXPECT_GE(progress.recorded, 3 * (12 + 4));
  const std::string one = csv_of(folder_ / "one.db");
  simulate(p, folder_ / "four.db", 4);
  EXPECT_EQ(csv_of(folder_ / "four.db"), one);
  simulate(p, folder_ / "other.db", 2, 2);
  EXPECT_NE(csv_of(folder_ / "other.db"), one) << "another seed, other participants";
}

TEST_F(SimulatedStudy, IsTheSameHoweverOftenItIsStopped) {
  const protocols::Protocol p = protocol();
  simulate(p, folder_ / "whole.db", 2);
  const fs::path db = folder_ / "stopped.db";
  stimuli::Random random(11);
  int stops = 0;
  for (bool done = false; !done;) {
    ASSERT_LT(stops, 1000);
    data::Store store = data::Store::open(db, data::Store::Mode::write_or_create);
    std::atomic<bool> stop{false};
    // A stop before the first report still finishes and records the trials under way.
    std::jthread stopper([&, after = random.below(40)] {
      std::this_thread::sleep_for(std::chrono::milliseconds(after));
      stop = true;
    });
    const StudyProgress progress =
        simulate_study(p, store, load_simulated_settings(""), {3, 1, 2}, stop, {});
    done = progress.recorded == progress.expected;
    ++stops;
  }
  EXPECT_GT(stops, 1) << "nothing was interrupted";
  EXPECT_EQ(csv_of(db), csv_of(folder_ / "whole.db"));
}

// The participant is frozen: whoever changes it gives it another version, and other trials here.
// The file is what this test writes beside the study when it fails.
TEST_F(SimulatedStudy, TheFrozenParticipantsTrialsStayWhatTheyWere) {
#ifdef __clang__
  GTEST_SKIP() << "other roundings grow to other trials: the file is the release compiler's, g++";
#endif
  const protocols::Protocol p =
      protocols::parse_protocol(PALPATE_SOURCE_DIR "/protocols/quick.json");
  simulate(p, folder_ / "frozen.db", 2);
  data::Store store = data::Store::open(folder_ / "frozen.db", data::Store::Mode::read_only);
  std::ifstream kept(PALPATE_SOURCE_DIR "/tests/runner/session/simulated_v2_trials.txt");
  std::ostringstream found;
  int trials = 0;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    const data::TrialRecord& r = trial.record;
    const std::string response = r.response.empty() ? "-" : r.response;
    char line[200];
    std::snprintf(line, sizeof line, "%s %d %s %s %s %.6f %.6f %.6f %.6f\n",
                  trial.participant.code.c_str(), r.trial, r.renderer.c_str(), r.shape.c_str(),
                  response.c_str(), r.response_time, r.first_contact_time.value_or(-1), r.max_force,
                  r.start_tip[0]);
    found << line;
    ++trials;
    struct {
      std::string code, renderer, shape, response;
      int trial = 0;
      double time = 0, contact = 0, force = 0, start = 0;
    } k;
    kept >> k.code >> k.trial >> k.renderer >> k.shape >> k.response >> k.time >> k.contact >>
        k.force >> k.start;
    kept.ignore(20, '\n');
    EXPECT_EQ(trial.participant.code, k.code);
    EXPECT_EQ(r.trial, k.trial);
    EXPECT_EQ(r.renderer, k.renderer);
    EXPECT_EQ(r.shape, k.shape);
    EXPECT_EQ(response, k.response) << line;
    EXPECT_NEAR(r.response_time, k.time, 1e-6) << line;
    EXPECT_NEAR(r.first_contact_time.value_or(-1), k.contact, 1e-6) << line;
    EXPECT_NEAR(r.max_force, k.force, 2e-6) << line;
    EXPECT_NEAR(r.start_tip[0], k.start, 1e-6) << line;
  });
  EXPECT_EQ(trials, 3 * 24);
  if (HasFailure()) std::ofstream(::testing::TempDir() + "simulated_v2_trials.txt") << found.str();
}

TEST_F(SimulatedStudy, KeepsSamplesWhenAsked) {
  const protocols::Protocol p = protocol(R"(, "samples": true)");
  simulate(p, folder_ / "samples.db", 2);
  data::Store store = data::Store::open(folder_ / "samples.db", data::Store::Mode::read_only);
  int trials = 0;
  store.for_each_trial(
      [&](const data::StoredTrial& trial) {
        ++trials;
        ASSERT_EQ(trial.record.samples.size(), trial.record.ticks);
        EXPECT_EQ(trial.record.samples.back().tick + 1, trial.record.ticks);
      },
      true);
  EXPECT_GE(trials, 48);
}

TEST_F(SimulatedStudy, RefusesWhatTheDeviceOrTheParticipantCannotDo) {
  const auto refusal = [&](const std::string& more) -> std::string {
    try {
      simulate(protocol(more), folder_ / "refused.db", 1);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal(R"(, "material": {"stiffness_n_per_m": 50000})").find("N/m"),
            std::string::npos);
  EXPECT_NE(refusal(R"(, "workspace": {"scale": 0.1})").find("reaches"), std::string::npos);
}

TEST(SimulatedSettings, PatchesAreCheckedAndChangeTheChecksum) {
  const fs::path path = fs::path(::testing::TempDir()) / "patch.json";
  const auto patched = [&](const std::string& text) {
    std::ofstream(path) << text;
    return load_simulated_settings(path);
  };
  const SimulatedSettings defaults = load_simulated_settings("");
  const SimulatedSettings quick = patched(R"({"motor": {"reaction_delay_s": 0.02}})");
  EXPECT_EQ(quick.motor.reaction_delay, 0.02);
  EXPECT_NE(quick.sha256, defaults.sha256);
  EXPECT_THROW(patched(R"({"motor": {"reaction": 0.02}})"), protocols::InputError);
  EXPECT_THROW(patched(R"({"motor": {"reaction_delay_s": "soon"}})"), protocols::InputError);
  EXPECT_THROW(patched(R"({"motor": 3})"), protocols::InputError);
  EXPECT_THROW(patched("{"), protocols::InputError);
  fs::remove(path);
}

}  // namespace
}  // namespace palpate::runner
