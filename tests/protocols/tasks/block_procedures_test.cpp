// Procedures read from a stored text are those of the recorded session.

#include "protocols/tasks/block_procedures.h"

#include <gtest/gtest.h>

#include "protocols/session_plan.h"
#include "protocols/tasks/levels.h"
#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {

nlohmann::json adaptive_study() {
  nlohmann::json document = task_study();
  document["blocks"].push_back(nlohmann::json::parse(
      R"({"name": "series", "task": "detect", "stimuli": ["lump", "soft"],
          "level": {"path": "/stiffness_n_per_m"},
          "procedure": [{"kind": "limits", "low": 100, "high": 500, "step": 20, "jitter_steps": 5},
                        {"kind": "quest_plus", "function": "normal", "levels": [100, 200, 300, 400],
                         "threshold": [150, 250, 350], "slope": [0.01, 0.02], "guess": 0.1,
                         "stop": {"trials": 20}}]})"));
  return document;
}

TEST(BlockProcedures, GiveTheEstimatesOfTheSessionsTracks) {
  const Protocol protocol = parsed(adaptive_study());
  const auto blocks = procedures_of_blocks(protocol.source_text, "study.json");
  ASSERT_EQ(blocks.size(), 4U);
  std::size_t compared = 0;
  for (const int participant : {1, 3, 8}) {
    SessionPlan plan(protocol, participant, 1);
    std::map<std::pair<int, int>, std::vector<Response>> answers;
    std::map<std::pair<int, int>, Estimate> estimates;
    while (!plan.finished()) {
      const Trial trial = plan.next();
      const TrialOutcome outcome = answer_to(trial);
      if (outcome.answered && trial.level && !trial.catch_trial)
        answers[{trial.task_block, trial.track}].push_back({*trial.level, outcome.success});
      plan.answered(outcome);
      if (!plan.tracks() || plan.block_begins()) continue;
      for (std::size_t i = 0; i < plan.tracks()->tracks().size(); ++i) {
        const Procedure& track = plan.tracks()->tracks()[i];
        const std::pair place(trial.task_block, static_cast<int>(i) + 1);
        if (track.history().size() < answers[place].size()) continue;  // the block is over
        estimates[place] = track.estimate();
      }
    }
    for (const auto& [place, estimate] : estimates) {
      const auto& [block, track] = place;
      const auto& procedures = blocks.at(protocol.blocks[static_cast<std::size_t>(block)].name);
      Procedure again = procedures.begin(participant, track);
      for (const Response& answer : answers[place]) {
        // Limits with a jitter begin at another level with another seed.
        if (again.history().size() < static_cast<std::size_t>(estimate.trials))
          again.record(answer);
      }
      EXPECT_EQ(again.estimate().threshold, estimate.threshold) << block << ", " << track;
      EXPECT_EQ(again.estimate().slope, estimate.slope);
      EXPECT_EQ(again.estimate().reversals, estimate.reversals);
      EXPECT_EQ(again.estimate().at_limit, estimate.at_limit);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 3U * (2 + 8));
}

TEST(BlockProcedures, HaveTheQuestionAndUnitOfTheLevel) {
  nlohmann::json document = task_study();
  document["blocks"][0]["asks"] = "smaller";
  document["blocks"].push_back(nlohmann::json::parse(
      R"({"name": "plain", "task": "detect", "stimuli": ["lump"], "repetitions": 2})"));
  const auto blocks = procedures_of_blocks(parsed(document).source_text, "study.json");
  EXPECT_TRUE(blocks.at("constant").asks_smaller);
  EXPECT_FALSE(blocks.at("stairs").asks_smaller);
  EXPECT_EQ(blocks.at("constant").level_unit, "N/m");
  EXPECT_EQ(blocks.at("lumps").level_unit, "m");
  EXPECT_EQ(blocks.at("plain").level_unit, "");
}

TEST(TypicalParticipant, LapsesAtBothEndsOfTwoSidedLevels) {
  const Protocol protocol = parsed(task_study());
  const TypicalSettings settings{0.5, 0.15, 0.07, 0.03};
  const auto rates = [&](std::size_t block) {
    const auto& found = typical_participant(protocol, protocol.blocks[block], settings).parameters;
    return std::pair(found.guess, found.lapse);
  };
  EXPECT_EQ(rates(0), std::pair(0.03, 0.03)) << "both sides";
  EXPECT_EQ(rates(1), std::pair(1.0 / 3, 0.03)) << "three intervals, one side";
  EXPECT_EQ(rates(2), std::pair(0.07, 0.03)) << "detection";
}

TEST(BlockProcedures, ConstantStimuliAndVersion1HaveNone) {
  const auto blocks = procedures_of_blocks(parsed(task_study()).source_text, "study.json");
  EXPECT_TRUE(std::holds_alternative<ConstantStimuli>(blocks.at("constant").spec_of(1)));
  const Protocol version_1 = parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000.json");
  EXPECT_TRUE(procedures_of_blocks(version_1.source_text, "ho2000.json").empty());
}

}  // namespace
}  // namespace palpate::protocols
