// Adjustments of simulated participants: the known point of equality is found, with the spread that
// follows from the model's noise.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/simulated_study.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session {
namespace {

constexpr double kStandard = 300, kLeast = 100, kMost = 600, kTurn = 20;  // N/m
constexpr double kWeber = 0.15;  // of the difference of two estimates, as in the model
constexpr int kParticipants = 6, kEach = 20;

struct Settings {
  double mean = 0, sd = 0;
  int unanswered = 0;
};

Settings simulated(std::uint64_t seed) {
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 2, "name": "adjustments", "renderers": ["point"], "orientation": "fixed",
          "home": {"rest_s": 0.1},
          "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 3,
                       "stiffness_n_per_m": 300}],
          "blocks": [{"name": "equal", "task": "adjust", "stimuli": ["ball"], "standard": "ball",
                      "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 600, "turn": 20,
                      "starts": [150, 550], "repetitions": 20}]})",
      "adjustments.json");
  const palpate::testing::TemporaryFolder folder;
  const std::string file = folder / "study.db";
  StudyProgress progress;
  {
    data::Store store = data::Store::open(file, data::Store::Mode::write_or_create);
    StudyPlan plan;
    plan.numbers = first_numbers(kParticipants);
    plan.seed = seed;
    progress = simulate_study(protocol, store, participants::load_simulated_settings(""), plan,
                              std::atomic<bool>{}, {});
  }
  Settings found;
  std::vector<double> numbers;
  data::Store store = data::Store::open(file, data::Store::Mode::read_only);
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (trial.record.task.number) numbers.push_back(*trial.record.task.number);
    found.unanswered += trial.record.timed_out ? 1 : 0;
  });
  EXPECT_EQ(progress.by_block["equal"].trials, kParticipants * kEach);
  EXPECT_EQ(progress.by_block["equal"].unanswered, found.unanswered);
  for (const double number : numbers) found.mean += number / static_cast<double>(numbers.size());
  for (const double number : numbers) found.sd += std::pow(number - found.mean, 2);
  found.sd = std::sqrt(found.sd / static_cast<double>(numbers.size() - 1));
  return found;
}

/// The same model written independently from its description in task_participant.h, without a hand:
/// two estimates whose difference has the model's noise, turned according to the estimates until
/// both are "same".
Settings expected() {
  constexpr std::uint64_t kSeed = 1;
  std::mt19937_64 source(kSeed);
  std::normal_distribution<double> normal(0, kWeber * kStandard / std::sqrt(2.0));
  std::vector<double> numbers;
  for (int i = 0; i < 40'000; ++i) {
    double level = i % 2 == 0 ? 150 : 550;
    const double standard = kStandard + normal(source);
    // At first it was felt before the standard; feel it again before turning it.
    if (std::abs(standard - (level + normal(source))) > kWeber * kStandard) {
      while (true) {
        const double apart = standard - (level + normal(source));
        const bool stuck = apart > 0 ? level >= kMost : level <= kLeast;
        if (std::abs(apart) <= kWeber * kStandard || stuck) break;
        level = std::clamp(level + kTurn * std::round(apart / kTurn), kLeast, kMost);
      }
    }
    numbers.push_back(level);
  }
  Settings out;
  for (const double number : numbers) out.mean += number / static_cast<double>(numbers.size());
  for (const double number : numbers) out.sd += std::pow(number - out.mean, 2);
  out.sd = std::sqrt(out.sd / static_cast<double>(numbers.size()));
  return out;
}

TEST(Adjustment, FindsTheStandardWithTheModelsSpread) {
  const Settings model = expected();
  std::printf("model alone: bias %.1f, spread %.1f N/m\n", model.mean - kStandard, model.sd);
  constexpr double kCount = kParticipants * kEach;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Settings found = simulated(seed);
    std::printf("seed %d: bias %.1f, spread %.1f N/m, %d of %.0f not ended in time\n",
                static_cast<int>(seed), found.mean - kStandard, found.sd, found.unanswered, kCount);
    EXPECT_NEAR(found.mean, model.mean, 3 * model.sd / std::sqrt(kCount));
    EXPECT_NEAR(found.sd, model.sd, 3 * model.sd / std::sqrt(2 * kCount));
    EXPECT_LE(found.unanswered, kCount / 10);  // formerly 80 %, with blind steps of one turn
  }
}

}  // namespace
}  // namespace palpate::runner::session
