// The same seed gives the same records, whatever the number of jobs and of interruptions.

#include "runner/session/simulated_study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "data/base/checksum.h"
#include "data/base/random.h"
#include "data/export/csv.h"
#include "protocols/parse.h"
#include "runner/session/replay_comparison.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session {
namespace {

namespace fs = std::filesystem;

class SimulatedStudy : public ::testing::Test {
 protected:
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
    EXPECT_FALSE(fs::exists(folder_ / "out_attempts.csv"))
        << "a simulated trial leaves no cut-off attempt";
    std::ifstream in(csv, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

  StudyProgress simulate(const protocols::Protocol& protocol, const fs::path& db, int jobs,
                         std::uint64_t seed = 1,
                         const participants::SimulatedSettings& settings =
                             participants::load_simulated_settings("")) const {
    data::Store store = data::Store::open(db, data::Store::Mode::write_or_create);
    const std::atomic<bool> never{false};
    return simulate_study(protocol, store, settings,
                          {.numbers = first_numbers(3), .seed = seed, .jobs = jobs}, never, {});
  }

  /// Settings with the patch in the text.
  participants::SimulatedSettings patched(const std::string& text, int version) const {
    std::ofstream(folder_ / "patch.json") << text;
    return participants::load_simulated_settings(folder_ / "patch.json", version);
  }

  /// Compares the trials of the frozen participant with the recorded ones; writes them beside the
  /// study if the test fails.
  void expect_frozen(int version) const;

  const palpate::testing::TemporaryFolder folder_;
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
  using Clock = std::chrono::steady_clock;
  const protocols::Protocol p = protocol();
  const auto began = Clock::now();
  simulate(p, folder_ / "whole.db", 2);
  const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - began);
  Random random(11);
  int interrupted = 0;
  // A machine that has become quicker finishes before the stop: then with shorter times again.
  for (double share = 0.25; interrupted == 0; share /= 2) {
    ASSERT_GT(share, 1e-6) << "nothing was interrupted";
    const fs::path db = folder_ / ("stopped " + std::to_string(share) + ".db");
    int stops = 0;
    for (bool done = false; !done; ++stops) {
      ASSERT_LT(stops, 1000);
      data::Store store = data::Store::open(db, data::Store::Mode::write_or_create);
      std::atomic<bool> stop{false};
      // Later at times: on one that has become busy such a time may be too short to begin.
      const double longest = share * static_cast<double>(whole.count()) * (1 + 0.04 * stops);
      const auto after = std::chrono::microseconds(static_cast<int>(random.unit() * longest));
      std::jthread stopper([&] {
        std::this_thread::sleep_for(after);
        stop = true;
      });
      const StudyProgress progress =
          simulate_study(p, store, participants::load_simulated_settings(""),
                         {.numbers = first_numbers(3), .seed = 1, .jobs = 2}, stop, {});
      done = progress.recorded == progress.expected;
      interrupted += progress.recorded > 0 && !done;
    }
    EXPECT_EQ(csv_of(db), csv_of(folder_ / "whole.db"));
  }
}

void SimulatedStudy::expect_frozen(int version) const {
  const std::string name = "simulated_v" + std::to_string(version) + "_trials.txt";
  const protocols::Protocol p =
      protocols::parse_protocol(PALPATE_SOURCE_DIR "/protocols/quick.json");
  const fs::path db = folder_ / ("frozen " + std::to_string(version) + ".db");
  simulate(p, db, 2, 1, participants::load_simulated_settings("", version));
  data::Store store = data::Store::open(db, data::Store::Mode::read_only);
  std::ifstream kept(PALPATE_SOURCE_DIR "/tests/runner/session/" + name);
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
  if (HasFailure()) std::ofstream(::testing::TempDir() + name) << found.str();
}

// The participants are frozen: a change requires a new version, and new trials here.
TEST_F(SimulatedStudy, TheFrozenParticipantsTrialsDoNotChange) {
#ifdef __clang__
  GTEST_SKIP() << "other roundings grow to other trials: the files are the release compiler's, g++";
#endif
  for (const int version : participants::participant_versions()) {
    SCOPED_TRACE("version " + std::to_string(version));
    expect_frozen(version);
  }
}

// Version 3 is version 2 with its switches on, and version 2 is version 1 with another search.
TEST_F(SimulatedStudy, VersionsDifferOnlyByTheirSwitches) {
  const protocols::Protocol p = protocol();
  const auto trials = [&](const std::string& name,
                          const participants::SimulatedSettings& settings) {
    simulate(p, folder_ / name, 2, 1, settings);
    std::string csv = csv_of(folder_ / name);
    for (std::size_t at; (at = csv.find(settings.sha256)) != std::string::npos;)
      csv.erase(at, settings.sha256.size());
    return csv;
  };
  const std::string version2 = trials("2.db", participants::load_simulated_settings("", 2));
  const std::string version3 = trials("3.db", participants::load_simulated_settings("", 3));
  EXPECT_NE(version2, version3);
  EXPECT_EQ(trials("3 from 2.db", patched(R"({"percept": {"place": "surface"},
      "observer": {"forgetting": false, "evidence": "movement"}, "heading": {"chosen": true}})",
                                          2)),
            version3);
  EXPECT_EQ(trials("2 from 1.db", patched(R"({"search": {"after_loss": "turn-to-centre"}})", 1)),
            version2);
  EXPECT_NE(trials("1.db", participants::load_simulated_settings("", 1)), version2);
}

// Each switch has its own effect.
TEST_F(SimulatedStudy, EverySwitchChangesTheTrials) {
  const protocols::Protocol p = protocol();
  std::vector<std::string> seen;
  for (const char* patch :
       {"{}", R"({"percept": {"place": "tip"}})", R"({"observer": {"forgetting": true}})",
        R"({"observer": {"evidence": "percept"}})", R"({"observer": {"movement_scale_m": 0.01}})",
        R"({"observer": {"turn_length_m_per_rad": 0.1}})",
        R"({"search": {"after_loss": "press-on"}})", R"({"heading": {"chosen": false}})",
        R"({"heading": {"interval_s": 0.1}})", R"({"heading": {"turning_time_s": 0.3}})",
        R"({"heading": {"hypotheses": 8}})", R"({"heading": {"headings": 3}})",
        R"({"heading": {"places": 1}})", R"({"heading": {"look_ahead_m": 0.04}})"}) {
    const participants::SimulatedSettings settings = patched(patch, 3);
    const fs::path db = folder_ / (std::to_string(seen.size()) + ".db");
    simulate(p, db, 2, 1, settings);
    std::string csv = csv_of(db);
    for (std::size_t at; (at = csv.find(settings.sha256)) != std::string::npos;)
      csv.erase(at, settings.sha256.size());
    EXPECT_EQ(std::count(seen.begin(), seen.end(), csv), 0) << patch;
    seen.push_back(csv);
  }
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

// With a stylus that reaches five times its length.
TEST_F(SimulatedStudy, ReplaysADistantObjectToTheBit) {
  protocols::Protocol p = protocol(
      R"(, "samples": true, "reach": {"factor": 5, "pivot": "tail"},
      "stylus": {"length_m": 0.1, "grip_m": 0.05}, "workspace": {"centre_m": [0, 0.45, 0]},
      "servo": {"material_limit": "limit"})");
  limit_for_simulation(p, participants::load_simulated_settings(""));
  EXPECT_LT(p.stimuli[0].object.material.stiffness, 800 / 25.0) << "a lever of 5 is felt 25 times";
  simulate(p, folder_ / "far.db", 2);
  data::Store store = data::Store::open(folder_ / "far.db", data::Store::Mode::read_only);
  int trials = 0, touched = 0;
  store.for_each_trial(
      [&](const data::StoredTrial& trial) {
        ++trials;
        touched += trial.record.first_contact_time.has_value();
        const data::SampleRecord& first = trial.record.samples.front();
        const auto& a = first.tip;
        const auto& b = first.tail;
        // The virtual stylus is on record: half a metre long, its tail within the hand's workspace.
        EXPECT_NEAR(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), 0.5, 1e-3);
        EXPECT_LT(std::hypot(b[0], b[1] + 0.45, b[2]), 0.25 + 0.06);
        if (trial.record.trial % 5 == 0) {
          const ReplayComparison again = compare_with_record(p, trial.record, false);
          EXPECT_EQ(again.equal_ticks, trial.record.samples.size());
        }
      },
      true);
  EXPECT_GE(trials, 48);
  EXPECT_GT(touched, trials / 2);
}

// The roll of a tool is carried from tick to tick and is not recorded: a replay reconstructs it.
TEST_F(SimulatedStudy, ReplaysABentToolAndLayersToTheBit) {
  const protocols::Protocol p = protocol(
      R"(, "samples": true, "tool": {"segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.12]},
      {"from_m": [0, 0, 0], "to_m": [0.015, 0, -0.005]}]},
      "material": {"stiffness_n_per_m": 300, "layers":
        [{"depth_m": 0.001, "stiffness_n_per_m": 200, "break_n": 0.2}, {"depth_m": 0.002, "stiffness_n_per_m": 300}]})");
  simulate(p, folder_ / "bent.db", 2);
  data::Store store = data::Store::open(folder_ / "bent.db", data::Store::Mode::read_only);
  int trials = 0, contacts = 0;
  store.for_each_trial(
      [&](const data::StoredTrial& trial) {
        if (++trials % 4 != 0) return;
        const ReplayComparison again = compare_with_record(p, trial.record, false);
        EXPECT_EQ(again.equal_ticks, trial.record.samples.size());
        for (const data::SampleRecord& sample : trial.record.samples) contacts += sample.contacts;
      },
      true);
  EXPECT_GE(trials, 48);
  EXPECT_GT(contacts, 1000);
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

TEST_F(SimulatedStudy, PatchesAreCheckedAndChangeTheChecksum) {
  const participants::SimulatedSettings defaults = participants::load_simulated_settings("", 2);
  const participants::SimulatedSettings quick =
      patched(R"({"motor": {"reaction_delay_s": 0.02}})", 2);
  EXPECT_EQ(quick.motor.reaction_delay, 0.02);
  EXPECT_NE(quick.sha256, defaults.sha256);
  EXPECT_EQ(patched("{}", 2).sha256, defaults.sha256);
  for (const char* bad :
       {R"({"motor": {"reaction": 0.02}})", R"({"motor": {"reaction_delay_s": "soon"}})",
        R"({"motor": {"reaction_delay_s": null}})", R"({"motor": 3})", "{", R"({"version": 3})",
        R"({"percept": {"place": "edge"}})", R"({"percept": {"place": 1}})",
        R"({"percept": {"place": null}})", R"({"observer": {"forgetting": 0}})",
        R"({"observer": {"evidence": true}})", R"({"heading": {"hypotheses": "many"}})",
        R"({"note": 5})"}) {
    EXPECT_THROW(patched(bad, 2), protocols::InputError) << bad;
  }
  EXPECT_THROW(participants::load_simulated_settings("", 4), std::invalid_argument);
}

// A checksum reported with results is that of the file published with them.
TEST_F(SimulatedStudy, ChecksumsEqualFrozenFiles) {
  for (const int version : participants::participant_versions()) {
    std::ifstream file(PALPATE_SOURCE_DIR "/runner/participants/simulated_v" +
                       std::to_string(version) + ".json");
    EXPECT_EQ(participants::load_simulated_settings("", version).sha256,
              checksum_hex(nlohmann::json::parse(file).dump()))
        << "version " << version;
  }
}

TEST_F(SimulatedStudy, VersionsAreFoundByTheirChecksums) {
  std::ofstream(folder_ / "patch.json") << R"({"motor": {"reaction_delay_s": 0.02}})";
  for (const int version : participants::participant_versions()) {
    const std::string plain = participants::load_simulated_settings("", version).sha256;
    const std::string patched =
        participants::load_simulated_settings(folder_ / "patch.json", version).sha256;
    EXPECT_EQ(participants::participant_version_of(plain, ""), version);
    EXPECT_EQ(participants::participant_version_of(patched, folder_ / "patch.json"), version);
    EXPECT_EQ(participants::participant_version_of(patched, ""), std::nullopt);
    EXPECT_EQ(participants::participant_version_of(plain, folder_ / "patch.json"), std::nullopt);
  }
  EXPECT_EQ(participants::load_simulated_settings("").version, 3);
}

// A later version's switch counts in an earlier version's checksum if it is changed.
TEST_F(SimulatedStudy, ChecksumsKnowEverySwitch) {
  const participants::SimulatedSettings defaults = participants::load_simulated_settings("", 2);
  EXPECT_EQ(patched(R"({"percept": {"place": "tip"}, "heading": {"chosen": false}})", 2).sha256,
            defaults.sha256);
  std::vector<std::string> seen{defaults.sha256};
  for (const char* patch :
       {R"({"percept": {"place": "surface"}})", R"({"heading": {"chosen": true}})",
        R"({"observer": {"forgetting": false}})", R"({"heading": {"interval_s": 0.2}})"}) {
    const std::string sha256 = patched(patch, 2).sha256;
    EXPECT_EQ(std::count(seen.begin(), seen.end(), sha256), 0) << patch;
    seen.push_back(sha256);
  }
}

// Every key can be found and changed in the text, in every version.
TEST_F(SimulatedStudy, SettingsAsTextHaveEveryKeyAndReadBackUnchanged) {
  const auto keys = [](int version) {
    std::vector<std::string> found;
    const nlohmann::json settings =
        nlohmann::json::parse(participants::simulated_settings_text("", version)).flatten();
    for (const auto& [pointer, value] : settings.items()) found.push_back(pointer);
    return found;
  };
  EXPECT_EQ(keys(1), keys(3));
  EXPECT_EQ(keys(2), keys(3));
  for (const int version : participants::participant_versions()) {
    EXPECT_EQ(
        participants::read_simulated_settings(participants::simulated_settings_text("", version))
            .sha256,
        participants::load_simulated_settings("", version).sha256);
  }
  nlohmann::json settings = nlohmann::json::parse(participants::simulated_settings_text("", 3));
  settings["heading"].erase("places");
  EXPECT_THROW(participants::read_simulated_settings(settings.dump()), protocols::InputError);
  settings["heading"]["places"] = "two";
  EXPECT_THROW(participants::read_simulated_settings(settings.dump()), protocols::InputError);
  settings["heading"]["places"] = 3;
  EXPECT_EQ(participants::read_simulated_settings(settings.dump()).heading.places, 3);
}

}  // namespace
}  // namespace palpate::runner::session
