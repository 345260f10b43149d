// Movements to targets of simulated participants, through servo, renderer and store.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/simulated_study.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session {
namespace {

constexpr double kDamping = 13;  // N s/m

protocols::Protocol study() {
  return protocols::parse_protocol_text(R"({"version": 2, "name": "r", "renderers": ["point"],
    "seed": 5, "home": {"rest_s": 0.1}, "samples": true,
    "stimuli": [
      {"name": "null", "shape": "none",
       "fields": [{"kind": "curl", "axis": [0, 0, 1], "damping_ns_per_m": 0}]},
      {"name": "curl", "shape": "none",
       "fields": [{"kind": "curl", "axis": [0, 0, 1], "damping_ns_per_m": 13, "destabilising": true}]}],
    "blocks": [
      {"name": "before", "task": "reach", "stimuli": ["null"], "repetitions": 6,
       "targets_m": [[0, 0.08, 0]], "time_window_s": [0.3, 0.8], "time_out_s": 4},
      {"name": "in", "task": "reach", "stimuli": ["curl"], "repetitions": 60,
       "targets_m": [[0, 0.08, 0]], "time_window_s": [0.3, 0.8], "time_out_s": 4,
       "clamp_share": 0.1},
      {"name": "after", "task": "reach", "stimuli": ["null"], "repetitions": 20,
       "targets_m": [[0, 0.08, 0]], "time_window_s": [0.3, 0.8], "time_out_s": 4}]})",
                                        "reach.json");
}

class ReachSession : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  static void simulate(const std::string& database, int stop_after = 0) {
    data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
    StudyPlan plan;
    plan.numbers = {1};
    plan.seed = 3;
    std::atomic<bool> stop{false};
    simulate_study(study(), store, participants::load_simulated_settings(""), plan, stop,
                   [&](const StudyProgress& progress) {
                     if (stop_after > 0 && progress.this_run >= stop_after) stop = true;
                   });
  }
  static std::vector<data::TrialRecord> trials_of(const std::string& database) {
    data::Store store = data::Store::open(database, data::Store::Mode::read_only);
    std::vector<data::TrialRecord> trials;
    store.for_each_trial([&](const data::StoredTrial& t) { trials.push_back(t.record); });
    return trials;
  }

  const palpate::testing::TemporaryFolder folder_;
};

/// mm, of the trials of a block with the field, in order.
std::vector<double> deviations(const std::vector<data::TrialRecord>& trials,
                               const std::string& block) {
  std::vector<double> out;
  for (const data::TrialRecord& trial : trials) {
    if (trial.task.block_name == block && trial.task.reach->kind == "field")
      out.push_back(1e3 * trial.task.reach->deviation.value());
  }
  return out;
}

double mean(const std::vector<double>& values, std::size_t from, std::size_t to) {
  double sum = 0;
  for (std::size_t i = from; i < to; ++i) sum += values.at(i);
  return sum / static_cast<double>(to - from);
}

TEST_F(ReachSession, HandIsPushedAsideAndLearns) {
  simulate(path("a.db"));
  const std::vector<data::TrialRecord> trials = trials_of(path("a.db"));
  ASSERT_EQ(trials.size(), 86U);
  for (const data::TrialRecord& trial : trials) {
    ASSERT_TRUE(trial.task.reach) << trial.trial;
    EXPECT_FALSE(trial.timed_out) << trial.trial;
    EXPECT_EQ(trial.correct, trial.response == "in_time");
    EXPECT_LT(*trial.task.reach->endpoint_error, 0.005);
    EXPECT_EQ(trial.task.level, 1);
  }
  const auto before = deviations(trials, "before"), in = deviations(trials, "in"),
             after = deviations(trials, "after");
  EXPECT_LT(std::abs(mean(before, 0, before.size())), 2);
  // The curl field pushes to the left, some 25 mm at first.
  EXPECT_GT(in.front(), 10);
  EXPECT_LT(mean(in, in.size() - 10, in.size()), 0.4 * in.front());
  // The learnt force pushes to the right without the field, and is forgotten.
  EXPECT_LT(after.front(), -5);
  EXPECT_GT(mean(after, after.size() - 5, after.size()), 0.6 * after.front());
}

TEST_F(ReachSession, ChannelFeelsWhatWasLearnt) {
  simulate(path("a.db"));
  std::vector<double> adaptations;
  for (const data::TrialRecord& trial : trials_of(path("a.db"))) {
    if (trial.task.reach->kind != "clamp") continue;
    EXPECT_EQ(trial.task.intervals.at(0).stimulus, "channel 1");
    // It holds the hand on the line.
    EXPECT_LT(std::abs(*trial.task.reach->largest_deviation), 0.006);
    adaptations.push_back(trial.task.reach->adaptation.value());
  }
  ASSERT_EQ(adaptations.size(), 6U);
  EXPECT_GT(adaptations.back(), 0.4);
  EXPECT_LT(adaptations.back(), 1.05);
}

TEST_F(ReachSession, LearningGoesOnAfterAnInterruption) {
  simulate(path("whole.db"));
  simulate(path("parts.db"), 20);
  ASSERT_LT(trials_of(path("parts.db")).size(), 86U);
  simulate(path("parts.db"));
  const auto whole = trials_of(path("whole.db")), parts = trials_of(path("parts.db"));
  ASSERT_EQ(whole.size(), parts.size());
  for (std::size_t i = 0; i < whole.size(); ++i)
    EXPECT_EQ(whole[i].task.reach->deviation, parts[i].task.reach->deviation) << i;
}

}  // namespace
}  // namespace palpate::runner::session
