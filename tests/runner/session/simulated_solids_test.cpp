// Simulated studies of objects without formulas, and of a participant that cannot begin.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>

#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/session/simulated_study.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session {
namespace {

namespace fs = std::filesystem;

class SimulatedSolids : public ::testing::Test {
 protected:
  StudyProgress simulate(const protocols::Protocol& protocol,
                         const participants::SimulatedSettings& settings, int participants) const {
    data::Store store = data::Store::open(db(), data::Store::Mode::write_or_create);
    const std::atomic<bool> never{false};
    return simulate_study(protocol, store, settings,
                          {.numbers = first_numbers(participants), .seed = 1, .jobs = 1}, never,
                          {});
  }
  fs::path db() const { return folder_ / "study.db"; }

  struct Count {
    int trials = 0, right = 0, touched = 0, last_of_first = 0;
  };
  Count count() const {
    Count found;
    data::Store store = data::Store::open(db(), data::Store::Mode::read_only);
    store.for_each_trial([&](const data::StoredTrial& trial) {
      ++found.trials;
      found.right += trial.record.correct ? 1 : 0;
      found.touched += trial.record.first_contact_time ? 1 : 0;
      if (trial.participant.code == "S001") found.last_of_first = trial.record.trial;
    });
    return found;
  }

  const palpate::testing::TemporaryFolder folder_;
};

// One presentation of each object under each renderer, through servo, renderers, session and store.
TEST_F(SimulatedSolids, ConcaveObjectsAreExploredAndIdentified) {
  protocols::Protocol protocol =
      protocols::parse_protocol(PALPATE_SOURCE_DIR "/protocols/concave.json");
  protocol.repetitions = 1;
  const StudyProgress progress = simulate(protocol, participants::load_simulated_settings(""), 1);
  EXPECT_EQ(progress.recorded, 8);
  const Count found = count();
  EXPECT_EQ(found.trials, 8);
  EXPECT_GE(found.touched, 7);
  EXPECT_GE(found.right, 5) << "2 would be chance";
}

// Equal outside: they differ in the depth of the first felt layer.
TEST_F(SimulatedSolids, LayersAreFeltAtTheirDepths) {
  protocols::Protocol protocol =
      protocols::parse_protocol(PALPATE_SOURCE_DIR "/protocols/layered.json");
  protocol.repetitions = 1;
  EXPECT_EQ(simulate(protocol, participants::load_simulated_settings(""), 2).recorded, 12);
  const Count found = count();
  EXPECT_GE(found.touched, 10);
  EXPECT_GE(found.right, 8) << "4 would be chance";
}

// Approaches begin outside the cube's home zone: it begins 62 mm from the centre, those of the
// other shapes at most at 53 mm.
TEST_F(SimulatedSolids, KeepsDataWhenATrialCannotBegin) {
  const protocols::Protocol protocol =
      protocols::parse_protocol(PALPATE_SOURCE_DIR "/protocols/quick.json");
  std::ofstream(folder_ / "near.json") << R"({"motor": {"approach_distance_m": 0.06}})";
  const participants::SimulatedSettings near =
      participants::load_simulated_settings(folder_ / "near.json");
  for (int attempt = 0; attempt < 2; ++attempt) {  // it stops at the same place again
    try {
      simulate(protocol, near, 1);
      FAIL() << "all trials began";
    } catch (const std::runtime_error& error) {
      const std::string text = error.what();
      const Count found = count();
      EXPECT_EQ(found.trials, found.last_of_first);
      EXPECT_GT(found.trials, 0);
      EXPECT_NE(
          text.find("participant 1, session 1, trial " + std::to_string(found.trials + 1) + " "),
          std::string::npos)
          << text;
      for (const char* word : {"/stylus/tilt_deg", "/motor/approach_distance_m",
                               "not in the home zone", "60 s of simulated time"}) {
        EXPECT_NE(text.find(word), std::string::npos) << word << " in: " << text;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::runner::session
