// Sessions of version 2 with simulated participants: every task through servo, store and export,
// and the same database whatever the interruptions.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "data/export/csv.h"
#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/replay_comparison.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"
#include "runner/session/trial_log.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session {
namespace {

using nlohmann::json;

json base() {
  return json::parse(R"({"version": 2, "name": "s", "renderers": ["point"], "seed": 5,
    "orientation": "fixed", "home": {"rest_s": 0.1},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2,
                 "stiffness_n_per_m": 300}]})");
}

json with_blocks(const char* blocks) {
  json document = base();
  document["blocks"] = json::parse(blocks);
  return document;
}

constexpr const char* kCompare = R"([
  {"name": "constant", "task": "compare", "stimuli": ["ball"], "standard": "ball",
   "level": {"path": "/stiffness_n_per_m"},
   "procedure": {"kind": "constant", "levels": [150, 300, 600], "repetitions": 2},
   "confidence": {"scale": [{"label": "guess", "number": 0}, {"label": "sure", "number": 5}]}},
  {"name": "stairs", "task": "compare", "stimuli": ["ball"], "standard": "ball",
   "level": {"path": "/stiffness_n_per_m"}, "interval_limit_s": 1.2,
   "procedure": {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [80],
                 "down": 2, "stop": {"trials": 5}}},
  {"name": "any", "task": "detect", "stimuli": ["ball"], "catch_trials": 0.4,
   "level": {"path": "/stiffness_n_per_m"},
   "procedure": {"kind": "constant", "levels": [20, 400], "repetitions": 3}}])";

protocols::Protocol parsed_study(const json& document) {
  return protocols::parse_protocol_text(document.dump(), "study.json");
}

class TaskSession : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  static void simulate(const protocols::Protocol& protocol, const std::string& database) {
    data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
    StudyPlan plan;
    plan.numbers = {1};
    plan.seed = 3;
    const std::atomic<bool> stop{false};
    simulate_study(protocol, store, participants::load_simulated_settings(""), plan, stop, {});
  }
  static std::vector<data::TrialRecord> trials_of(const std::string& database) {
    data::Store store = data::Store::open(database, data::Store::Mode::read_only);
    std::vector<data::TrialRecord> trials;
    store.for_each_trial([&](const data::StoredTrial& t) { trials.push_back(t.record); });
    return trials;
  }
  std::string csv_of(const std::string& database) const {
    data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
    data::ExportSettings settings;
    settings.force = true;
    data::export_csv(store, path("trials.csv"), settings);
    std::ifstream file(path("trials.csv"));
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  const palpate::testing::TemporaryFolder folder_;
};

TEST_F(TaskSession, RecordsEveryIntervalOfAComparison) {
  simulate(parsed_study(with_blocks(kCompare)), path("a.db"));
  int compared = 0, detected = 0, catches = 0;
  for (const data::TrialRecord& trial : trials_of(path("a.db"))) {
    ASSERT_TRUE(trial.task.of_block());
    const data::TaskRecord& task = trial.task;
    EXPECT_FALSE(trial.response.empty());
    std::int64_t before = 0;
    for (const data::IntervalRecord& interval : task.intervals) {
      EXPECT_GT(interval.onset_ns, before);
      EXPECT_GT(interval.end_ns, interval.onset_ns);
      before = interval.end_ns;
    }
    EXPECT_EQ(task.intervals.back().onset_ns, trial.onset_ns);
    if (task.task == "compare") {
      ++compared;
      ASSERT_EQ(task.intervals.size(), 2U);
      const std::size_t chosen = trial.response == "1" ? 0 : 1;
      EXPECT_EQ(task.success, !task.intervals[chosen].standard);
      EXPECT_EQ(task.intervals[0].standard, !task.intervals[1].standard);
      EXPECT_EQ(task.standard_level, 300);
      EXPECT_EQ(trial.correct, task.success == (*task.level >= 300));
      EXPECT_EQ(task.confidence.has_value(), task.block_name == "constant");
      if (task.block_name == "stairs") {
        // Forces go off at the limit, and the answer is given without them.
        for (const data::IntervalRecord& i : task.intervals)
          EXPECT_NEAR(static_cast<double>(i.end_ns - i.onset_ns), 1.2e9, 2e6);
        EXPECT_GE(trial.response_time, 1.2);
      }
    } else {
      ++detected;
      catches += task.catch_trial ? 1 : 0;
      EXPECT_EQ(task.intervals[0].stimulus.empty(), task.catch_trial);
      EXPECT_EQ(trial.correct, (trial.response == "yes") != task.catch_trial);
      EXPECT_EQ(trial.max_force > 0, !task.catch_trial) << "trial " << trial.trial;
    }
  }
  EXPECT_EQ(compared, 11);
  EXPECT_EQ(detected, 10);
  EXPECT_EQ(catches, 4);
}

/// Keeps what it is given.
class KeptTrials final : public TrialLog {
 public:
  int begin(const data::TrialRecord&, std::int64_t) override { return 1; }
  void finish(const data::TrialRecord& record) override { trials.push_back(record); }
  void cut_off(const std::string& reason) override { FAIL() << reason; }
  std::vector<data::TrialRecord> trials;
};

TEST_F(TaskSession, GivesTheSameDatabaseWhereverItIsInterrupted) {
  const protocols::Protocol protocol = parsed_study(with_blocks(kCompare));
  const participants::SimulatedSettings settings = participants::load_simulated_settings("");
  simulate(protocol, path("whole.db"));
  const std::string expected = csv_of(path("whole.db"));
  const std::size_t count = trials_of(path("whole.db")).size();
  ASSERT_EQ(count, 21U);
  const SimulatedStudy study(protocol, settings, 3);
  const data::ClockStamp utc = simulated_run(protocol, settings, 1, 1).clock;
  for (std::size_t stop = 0; stop < count; ++stop) {
    KeptTrials before;
    run_simulated_session(study, {1, protocols::SessionPlan(protocol, 1, 1), 0, utc}, before,
                          [&] { return before.trials.size() >= stop; });
    ASSERT_EQ(before.trials.size(), stop);
    const std::string database = path("stop-" + std::to_string(stop) + ".db");
    {
      data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
      const auto person = store.enrol(info_of(protocol), "S001", 1, true, 3);
      const auto run = store.begin_run(person, simulated_run(protocol, settings, 1, 1));
      store.record_simulated(run, before.trials);
    }  // killed
    simulate(protocol, database);
    EXPECT_EQ(csv_of(database), expected) << "interrupted after trial " << stop;
  }
}

TEST_F(TaskSession, JudgesStiffnessByTheMeasuredForces) {
  json document = with_blocks(kCompare);
  document["blocks"] = json::array({json(document["blocks"][0])});
  document["blocks"][0]["procedure"]["levels"] = {100, 900};
  document["blocks"][0]["procedure"]["repetitions"] = 10;
  simulate(parsed_study(document), path("a.db"));
  int right = 0;
  for (const data::TrialRecord& trial : trials_of(path("a.db"))) right += trial.correct ? 1 : 0;
  EXPECT_GE(right, 18);  // of 20: a factor of 3, apart from lapses
}

TEST_F(TaskSession, RatesAndAdjusts) {
  simulate(parsed_study(with_blocks(R"([
    {"name": "number", "task": "rate", "stimuli": ["ball"], "level": {"path": "/stiffness_n_per_m"},
     "procedure": {"kind": "constant", "levels": [100, 400], "repetitions": 3}, "min": 0},
    {"name": "scale", "task": "rate", "stimuli": ["ball"], "standard": "ball", "modulus": 10,
     "level": {"path": "/stiffness_n_per_m"},
     "procedure": {"kind": "constant", "levels": [100, 400], "repetitions": 1},
     "scale": [{"label": "soft", "number": -1}, {"label": "hard", "number": 1}]},
    {"name": "equal", "task": "adjust", "stimuli": ["ball"], "standard": "ball",
     "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 600, "turn": 40,
     "starts": [150, 550], "repetitions": 2}])")),
           path("a.db"));
  double soft = 0, hard = 0;
  for (const data::TrialRecord& trial : trials_of(path("a.db"))) {
    const data::TaskRecord& task = trial.task;
    ASSERT_TRUE(task.number.has_value()) << task.block_name;
    if (task.block_name == "number") (*task.level < 200 ? soft : hard) += *task.number;
    if (task.block_name == "scale") {
      EXPECT_EQ(std::abs(*task.number), 1);
      EXPECT_EQ(task.intervals.size(), 2U);
    }
    if (task.block_name != "equal") continue;
    EXPECT_TRUE(task.level == 150 || task.level == 550);
    EXPECT_NEAR(*task.number, 300, 150);
    EXPECT_GT(task.intervals.size(), 2U);
    EXPECT_EQ(task.intervals.front().onset_ns, trial.onset_ns);
    // From one adjusted interval to the next, the level changes by whole turns, within the limits.
    double level = *task.level;
    for (const data::IntervalRecord& interval : task.intervals) {
      if (interval.standard) continue;
      const double turns = (*interval.level - level) / 40;
      EXPECT_TRUE(turns == std::round(turns) || *interval.level == 100 || *interval.level == 600)
          << *interval.level;
      level = *interval.level;
    }
    EXPECT_EQ(level, *task.number);
  }
  EXPECT_GT(hard, 1.5 * soft);
}

TEST_F(TaskSession, IdentifiesAsInVersion1) {
  const json keys = {{"1", "ball"}, {"2", "die"}};
  json one = base();
  one["version"] = 1;
  one["orientation"] = "uniform";
  one["stimuli"].push_back(
      {{"name", "die"}, {"shape", "cube"}, {"edge_m", 0.05}, {"stiffness_n_per_m", 300}});
  one["samples"] = true;
  json two = one;
  one["repetitions"] = 3;
  one["response"] = {{"keys", keys}};
  two["version"] = 2;
  two["blocks"] = {{{"name", "shapes"},
                    {"task", "identify"},
                    {"stimuli", {"ball", "die"}},
                    {"repetitions", 3},
                    {"keys", keys}}};
  simulate(parsed_study(one), path("one.db"));
  simulate(parsed_study(two), path("two.db"));
  const auto expected = trials_of(path("one.db")), found = trials_of(path("two.db"));
  ASSERT_EQ(found.size(), 6U);
  ASSERT_EQ(expected.size(), 6U);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].shape, expected[i].shape);
    EXPECT_EQ(found[i].orientation_wxyz, expected[i].orientation_wxyz);
    EXPECT_EQ(found[i].response, expected[i].response);
    EXPECT_EQ(found[i].correct, expected[i].correct);
    EXPECT_EQ(found[i].response_time, expected[i].response_time);
    EXPECT_EQ(found[i].onset_ns, expected[i].onset_ns);
    EXPECT_EQ(found[i].ticks, expected[i].ticks);
    EXPECT_EQ(found[i].max_force, expected[i].max_force);
    EXPECT_EQ(found[i].first_contact_time, expected[i].first_contact_time);
    EXPECT_EQ(found[i].contact_share, expected[i].contact_share);
    ASSERT_TRUE(found[i].task.of_block());
    EXPECT_EQ(found[i].task.success, found[i].correct);
  }
}

TEST_F(TaskSession, IdentifiesStimuliThatDifferOnlyInStiffness) {
  json document = base();
  document["stimuli"].push_back(document["stimuli"][0]);
  document["stimuli"][1]["name"] = "hard-ball";
  document["stimuli"][1]["stiffness_n_per_m"] = 900;
  document["blocks"] = {{{"name", "which"},
                         {"task", "identify"},
                         {"stimuli", {"ball", "hard-ball"}},
                         {"repetitions", 10},
                         {"keys", {{"1", "ball"}, {"2", "hard-ball"}}}}};
  simulate(parsed_study(document), path("a.db"));
  int right = 0;
  for (const data::TrialRecord& trial : trials_of(path("a.db"))) right += trial.correct ? 1 : 0;
  EXPECT_GE(right, 17);  // of 20: a factor of 3, apart from lapses
  EXPECT_LE(right, 20);
}

TEST_F(TaskSession, JudgesSizesByTheContactPlaces) {
  const auto share_right = [&](double level, const std::string& name) {
    json document = base();
    document["blocks"] = {
        {{"name", "size"},
         {"task", "compare"},
         {"stimuli", {"ball"}},
         {"standard", "ball"},
         {"level", {{"path", "/radius_m"}}},
         {"procedure", {{"kind", "constant"}, {"levels", {level}}, {"repetitions", 30}}}}};
    simulate(parsed_study(document), path(name));
    int right = 0;
    for (const data::TrialRecord& trial : trials_of(path(name))) right += trial.correct ? 1 : 0;
    return right / 30.0;
  };
  const double alike = share_right(0.0305, "alike.db"), apart = share_right(0.042, "apart.db");
  EXPECT_GE(apart, 0.9);  // 12 mm, some four standard deviations of the percept
  EXPECT_LT(alike, apart);
  EXPECT_LT(alike, 0.85);  // half a millimetre
}

TEST_F(TaskSession, RepeatsItsTrialsToTheBit) {
  json document = base();
  document["renderers"] = {"point", "ray"};
  document["orientation"] = "uniform";
  document["samples"] = true;
  document["blocks"] = json::parse(R"([
    {"name": "two", "task": "compare", "stimuli": ["ball"], "standard": "ball",
     "renderers": ["ray"], "standard_renderer": "point", "level": {"path": "/radius_m"},
     "procedure": {"kind": "staircase", "start": 0.036, "min": 0.03, "max": 0.04,
                   "steps": [0.002], "down": 2, "stop": {"trials": 3}}},
    {"name": "any", "task": "detect", "stimuli": ["ball"], "renderers": ["point"],
     "catch_trials": 0.5, "level": {"path": "/stiffness_n_per_m"},
     "procedure": {"kind": "constant", "levels": [200], "repetitions": 1}},
    {"name": "equal", "task": "adjust", "stimuli": ["ball"], "standard": "ball",
     "renderers": ["ray"], "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 600,
     "turn": 60, "starts": [150, 550]}])");
  const protocols::Protocol protocol = parsed_study(document);
  simulate(protocol, path("a.db"));
  data::Store store = data::Store::open(path("a.db"), data::Store::Mode::read_only);
  int intervals = 0, trials = 0;
  double differences = 0;
  store.for_each_trial(
      [&](const data::StoredTrial& stored) {
        ++trials;
        const ReplayComparison again = compare_with_record(protocol, stored.record, true);
        EXPECT_EQ(again.equal_ticks, stored.record.samples.size());
        EXPECT_EQ(again.ticks.size(), stored.record.samples.size());
        ASSERT_EQ(again.intervals.size(), stored.record.task.intervals.size());
        std::uint64_t ticks = 0;
        for (const ReplayedInterval& one : again.intervals) {
          EXPECT_GT(one.ticks, 100U);
          ticks += one.ticks;
        }
        EXPECT_EQ(ticks, stored.record.ticks);
        intervals += static_cast<int>(again.intervals.size());
        const bool empty = stored.record.task.catch_trial;
        EXPECT_EQ(again.recorded.max_force > 0, !empty);
        differences += again.rms_difference;
      },
      true);
  EXPECT_EQ(trials, 6);
  EXPECT_GT(intervals, 10);
  EXPECT_GT(differences, 0);  // the side of the stylus touches somewhere
}

TEST_F(TaskSession, ExportsTheColumnsOfTasksForVersion2Only) {
  simulate(parsed_study(with_blocks(kCompare)), path("a.db"));
  const std::string csv = csv_of(path("a.db"));
  EXPECT_NE(csv.find("edge_dwell,task,block_name,track,level,standard_level,catch_trial,success,"
                     "number,confidence,confidence_delay,comparison_interval,interval_onsets,"
                     "interval_ends,interval_levels"),
            std::string::npos);
  simulate(protocols::parse_protocol(PALPATE_SOURCE_DIR "/protocols/quick.json"), path("one.db"));
  const std::string plain = csv_of(path("one.db"));
  EXPECT_EQ(plain.substr(0, plain.find('\n')).find("block_name"), std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::session
