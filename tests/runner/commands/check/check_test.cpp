// A study run as registered passes the check. Each single deviation is named with its evidence, and
// only that one.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"
#include "data/base/checksum.h"
#include "data/store/task_text.h"
#include "protocols/parse.h"
#include "runner/build_info.h"
#include "runner/commands/shared/command.h"
#include "runner/registration/deviations.h"
#include "runner/session/run_record.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::commands {
namespace {

constexpr const char* kProtocol = R"({"version": 1, "name": "brief", "renderers": ["point", "ray"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2},
              {"name": "cone", "shape": "cone", "radius_m": 0.03, "height_m": 0.06}],
  "repetitions": 4, "practice": {"repetitions": 1}, "sessions": {"count": 2},
  "masking_noise": {"kind": "pink", "level_db": -24},
  "response": {"keys": {"1": "ball", "2": "cone"}, "time_out_s": 30}, "seed": 3})";
constexpr const char* kHypotheses = R"([
  {"id": "H1", "text": "Faster.", "corroborated": "paired.cone.p_holm < 0.05 && paired.cone.reduction > 0",
   "refuted": "paired.cone.ci95_high < 5"},
  {"id": "H2", "text": "Slower.", "corroborated": "paired.ball.reduction < -50",
   "refuted": "paired.ball.reduction > 50"},
  {"id": "H3", "text": "Both.", "corroborated": "counts.accuracy == 1 && paired_by_shape.ball.n_pairs == 4",
   "refuted": "alpha == 0.05"}])";

std::string plan_text() {
  return R"({"version": 1, "pilot_label": null,
    "settings": {"power": 0.8, "alpha": 0.05, "goal": "all", "test": "paired", "studies": 100, "seed": 1,
                 "participants": [2, 10]},
    "model": {"percent_reduction": {"ball": 0, "cone": 40}, "log_ratio": {"ball": 0.0, "cone": -0.51},
      "gain_sd": 0.05, "shape_gain_sd": 0.02, "intercept_sd": 0.3, "correlation": 0.0, "residual_sd": 0.3,
      "share_used": 0.9},
    "needed": [{"trials_per_cell": 4, "trials_per_participant": 16, "participants": 4}],
    "curves": [{"trials_per_cell": 4, "points": [{"participants": 4, "trials_per_cell": 4, "power": 0.9}]}],
    "notes": []})";
}

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

constexpr std::int64_t kHour_ns = 3'600'000'000'000;

/// Deviations of a study from the registered one; by default none.
struct Change {
  std::string protocol = kProtocol;
  int participants = 4;
  bool simulated = false;
  int simulated_from = 99;  ///< number of the first simulated participant among people
  int swap_of = 0;          ///< number of the participant with two trials in the wrong order
  int stop_of = 0;          ///< number of the participant without the last trial
  int early = 0;            ///< number of the participant who begins before the registration
  int other_version = 0;    ///< number of the participant recorded with another version
  std::string note = {};    ///< on participant 2
  int withdraws = 0;        ///< number of the participant who withdraws
};

class Check : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new testing::TemporaryFolder;
    write(*shared_ / "brief.json", kProtocol);
    write(*shared_ / "plan.json", plan_text());
    write(*shared_ / "hypotheses.json", kHypotheses);
    ASSERT_EQ(register_command({*shared_ / "brief.json", "--plan", *shared_ / "plan.json",
                                "--hypotheses", *shared_ / "hypotheses.json", "--out",
                                *shared_ / "registration", "--studies", "20"}),
              0);
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }

  void SetUp() override {
    std::filesystem::copy(*shared_ / "registration", registration(),
                          std::filesystem::copy_options::recursive);
  }
  std::string registration() const { return folder_ / "registration"; }
  std::string database() const { return folder_ / "study.db"; }

  void run(const Change& change = {}) {
    const registration::Registration registered = registration::read_registration(registration());
    const protocols::Protocol protocol =
        protocols::parse_protocol_text(change.protocol, "brief.json");
    data::Store store = data::Store::open(database(), data::Store::Mode::write_or_create);
    for (int number = 1; number <= change.participants; ++number) {
      const bool simulated = change.simulated || number >= change.simulated_from;
      const data::Participant person =
          store.enrol(session::info_of(protocol), "P0" + std::to_string(number), number, simulated,
                      simulated ? std::optional<std::uint64_t>(1) : std::nullopt);
      for (int session = 1; session <= 2; ++session) {
        data::RunInfo info;
        info.session = session;
        info.clock = {registered.made_utc_ns + (number == change.early ? -kHour_ns : kHour_ns), 0};
        info.program_version = number == change.other_version ? "0.0.1" : PALPATE_VERSION;
        info.build = build_description();
        info.device = "mouse";
        const data::Run run = store.begin_run(person, info);
        if (number == 2 && session == 1 && !change.note.empty())
          store.add_note(run, 0, change.note);
        std::vector<protocols::Trial> trials;
        for (const protocols::Trial& trial : protocols::schedule(protocol, number)) {
          if (trial.session == session) trials.push_back(trial);
        }
        if (number == change.swap_of && session == 1) {
          // Swap neighbours of different shapes, so that the order differs but not the counts.
          for (std::size_t i = 0; i + 1 < trials.size(); ++i) {
            if (trials[i].practice || trials[i].stimulus == trials[i + 1].stimulus) continue;
            std::swap(trials[i].stimulus, trials[i + 1].stimulus);
            break;
          }
        }
        if (number == change.stop_of && session == 2) trials.pop_back();
        record(store, run, protocol, trials, number, simulated);
        store.end_run(run,
                      number == change.withdraws && session == 2 ? data::RunEnd::withdrawn
                                                                 : data::RunEnd::done,
                      kHour_ns);
      }
    }
  }

  static void record(data::Store& store, const data::Run& run, const protocols::Protocol& protocol,
                     const std::vector<protocols::Trial>& trials, int number, bool simulated) {
    std::int64_t now = 0;
    for (const protocols::Trial& trial : trials) {
      data::TrialRecord record;
      record.session = trial.session;
      record.block = trial.block;
      record.trial = trial.trial;
      record.renderer = protocols::to_string(trial.renderer);
      record.shape = protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
      record.response = record.shape;
      record.correct = true;
      record.practice = trial.practice;
      record.orientation_wxyz = {trial.orientation.w, trial.orientation.x, trial.orientation.y,
                                 trial.orientation.z};
      record.response_time = (record.renderer == "ray" && record.shape == "cone" ? 2 : 4) +
                             0.1 * number + 0.01 * trial.trial;
      record.onset_ns = now += 1'000'000'000;
      record.response_ns = now += std::llround(1e9 * record.response_time);
      if (simulated) {
        store.record_simulated(run, {record});
        continue;
      }
      record.attempt = store.begin_attempt(run, record, record.onset_ns);
      store.finish_attempt(run, record);
    }
  }

  registration::StudyCheck check(const registration::ReportedAnalysis& reported = {}) const {
    return registration::check_study(registration::read_registration(registration()),
                                     registration(), database(), reported);
  }

  /// Ids of the deviating points.
  static std::vector<std::string> deviating(const registration::StudyCheck& check) {
    std::vector<std::string> ids;
    for (const registration::CheckPoint& point : check.points) {
      if (point.finding == registration::Finding::deviation) ids.push_back(point.id);
    }
    return ids;
  }
  static std::string evidence(const registration::StudyCheck& check) {
    std::string all;
    for (const registration::CheckPoint& point : check.points) {
      if (point.finding != registration::Finding::deviation) continue;
      for (const std::string& line : point.evidence) all += line + "\n";
    }
    return all;
  }
  /// Expects only this deviation, with these words in its evidence.
  static void expect_alone(const registration::StudyCheck& check, const std::string& id,
                           const std::vector<std::string>& words) {
    EXPECT_EQ(deviating(check), std::vector<std::string>{id});
    for (const std::string& word : words)
      EXPECT_NE(evidence(check).find(word), std::string::npos) << word << "\n" << evidence(check);
  }

  testing::TemporaryFolder folder_;
  static testing::TemporaryFolder* shared_;
};

testing::TemporaryFolder* Check::shared_ = nullptr;

TEST_F(Check, AStudyThatMatchesItsRegistrationPasses) {
  run();
  const registration::StudyCheck found = check();
  EXPECT_EQ(deviating(found), std::vector<std::string>{}) << evidence(found);
  EXPECT_EQ(registration::conclusion_of(found), "Run as registered");
  EXPECT_EQ(found.participants, 4U);
  EXPECT_EQ(found.label, "");
}

TEST_F(Check, HypothesesAreJudged) {
  run();
  const registration::StudyCheck found = check();
  ASSERT_EQ(found.hypotheses.size(), 3U);
  EXPECT_EQ(found.hypotheses[0].second.verdict, analysis::Verdict::corroborated);
  EXPECT_EQ(found.hypotheses[1].second.verdict, analysis::Verdict::undecided);
  // Both conditions hold: the hypothesis is not decided.
  EXPECT_EQ(found.hypotheses[2].second.verdict, analysis::Verdict::undecided);
  EXPECT_EQ(found.hypotheses[2].second.corroborated, true);
  EXPECT_EQ(found.hypotheses[2].second.refuted, true);
}

TEST_F(Check, SimulatedParticipantsAreLabelledAndHaveNoDates) {
  run({.simulated = true, .early = 1});
  const registration::StudyCheck found = check();
  EXPECT_EQ(deviating(found), std::vector<std::string>{}) << evidence(found);
  EXPECT_EQ(found.label, "SIMULATED PARTICIPANTS");
}

TEST_F(Check, AChangedByteOfTheProtocolIsADeviation) {
  run({.protocol = std::string(kProtocol) + " "});
  expect_alone(check(), "protocol",
               {"P01", "P04", "layout", checksum_hex(std::string(kProtocol) + " ").substr(0, 12)});
}

TEST_F(Check, AChangedTextOfTheProtocolIsADeviation) {
  std::string changed = kProtocol;
  changed.replace(changed.find("\"repetitions\""), 0, "\"title\": \"Other\", ");
  run({.protocol = changed});
  expect_alone(check(), "protocol", {"only texts: /title"});
}

TEST_F(Check, SwappedTrialsAreADeviation) {
  run({.swap_of = 3});
  expect_alone(check(), "order", {"P03 (number 3): session 1, trial", "registered 1,"});
}

TEST_F(Check, AMissingParticipantIsADeviation) {
  run({.participants = 3});
  expect_alone(check(), "participants", {"no participant has number 4"});
}

TEST_F(Check, AnAdditionalParticipantIsADeviation) {
  run({.participants = 5});
  expect_alone(check(), "participants", {"P05 has number 5"});
}

TEST_F(Check, AMissingTrialIsADeviation) {
  run({.stop_of = 2});
  expect_alone(check(), "trials", {"P02: 15 of 16 trials"});
}

TEST_F(Check, MixingPeopleAndSimulatedParticipantsIsADeviation) {
  run({.simulated_from = 4});
  expect_alone(check(), "people", {"simulated: P04", "people: P01, P02 and P03"});
}

TEST_F(Check, ASessionBeforeTheRegistrationIsADeviation) {
  run({.early = 2});
  expect_alone(check(), "dates", {"P02, session 1: began on", "P02, session 2"});
}

TEST_F(Check, AnotherExclusionIsADeviation) {
  run();
  expect_alone(check({.too_fast = 0.5}), "exclusion", {"used 0.5 s, registered 0.2 s"});
}

TEST_F(Check, AnotherAlphaIsADeviation) {
  run();
  expect_alone(check({.alpha = 0.1}), "alpha", {"used 0.1, registered 0.05"});
}

TEST_F(Check, AnotherVersionIsADeviation) {
  run({.other_version = 2});
  expect_alone(check(), "versions", {"P02: recorded with palpate 0.0.1"});
}

TEST_F(Check, OmittedCalibrationIsADeviation) {
  run({.note = "pre-flight: homed; WITHOUT calibration"});
  expect_alone(check(), "calibration", {"P02, session 1: pre-flight"});
}

TEST_F(Check, OmittedNoiseIsADeviation) {
  run({.note = R"({"masking_noise":"left out"})"});
  expect_alone(check(), "noise", {"P02, session 1"});
}

TEST_F(Check, OmittedSoundsAreADeviation) {
  run({.note = R"({"sounds":"left out"})"});
  expect_alone(check(), "sounds", {"P02, session 1"});
}

TEST_F(Check, OmittedTorqueIsADeviation) {
  run({.note = data::kTorqueLeftOutNote});
  expect_alone(check(), "torque", {"P02, session 1"});
}

TEST_F(Check, LevelsFromOutsideAreADeviation) {
  run({.note =
           R"({"level_from_own_procedure":{"session":1,"trial":2,"level":1.0,"reason":"late"}})"});
  expect_alone(check(), "levels", {"P02, session 1"});
}

TEST_F(Check, ANoteThatOnlyMentionsThemIsNoDeviation) {
  run({.note = "the participant asked about masking_noise and WITHOUT calibration"});
  EXPECT_EQ(deviating(check()), std::vector<std::string>{});
}

TEST_F(Check, AChangedRegistrationIsReported) {
  run();
  std::ofstream(registration() + "/codebook.csv", std::ios::app) << "more\n";
  expect_alone(check(), "registration", {"codebook.csv has changed"});
}

TEST_F(Check, AnAddedOrMissingFileOfTheRegistrationIsReported) {
  run();
  std::filesystem::remove(registration() + "/codebook.csv");
  write(registration() + "/more.txt", "more");
  expect_alone(check(), "registration", {"codebook.csv is missing", "more.txt is not listed"});
}

TEST_F(Check, FillingInTheRequestedFieldsIsNoDeviation) {
  run();
  const std::string path = registration() + "/registration.md";
  std::string text = text_of(path);
  const std::size_t field = text.find("\n**FILL IN:**");
  ASSERT_NE(field, std::string::npos) << text;
  text.replace(field + 1, text.find('\n', field + 1) - field - 1, "Answers.");
  write(path, text);
  const registration::StudyCheck found = check();
  EXPECT_EQ(deviating(found), std::vector<std::string>{});
  EXPECT_NE(found.points[0].sentence.find("registration.md"), std::string::npos);
}

TEST_F(Check, DifferentReportedNumbersAreReported) {
  run();
  data::Store store = data::Store::open(database(), data::Store::Mode::read_only);
  const std::string good = analysis::report_json(
      analysis::analyze(analysis::read_trials_store(store), {}, PALPATE_VERSION));
  EXPECT_EQ(deviating(check({.json = good})), std::vector<std::string>{});
  nlohmann::ordered_json bad = nlohmann::ordered_json::parse(good);
  bad["paired_by_shape"]["cone"]["t_test"]["p_holm"] = 0.001;
  expect_alone(check({.json = bad.dump()}), "analysis",
               {"paired_by_shape.cone.t_test.p_holm: reported 0.001"});
}

TEST_F(Check, WithdrawnParticipantsAreNotUsed) {
  run({.withdraws = 3});
  try {
    check();
    FAIL() << "a participant who withdrew was used";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("P03 has withdrawn"), std::string::npos);
  }
}

TEST_F(Check, ForeignTextsAreShownLiterally) {
  run({.note = "pre-flight: <script>alert(1)</script>; WITHOUT calibration"});
  const registration::StudyCheck found = check();
  const std::string page =
      registration::check_html(found, registration::read_registration(registration()));
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_NE(page.find("&lt;script&gt;alert(1)"), std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::commands
