// Identification in version 2 has the trials of version 1.

#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

/// The same study in version 1 and in version 2.
struct SameStudy {
  json one, two;
};

SameStudy identification(const char* orientation) {
  const json stimuli = json::parse(
      R"([{"name": "sphere", "shape": "sphere", "radius_m": 0.03},
          {"name": "cone", "shape": "cone", "radius_m": 0.03, "height_m": 0.06},
          {"name": "cube", "shape": "cube", "edge_m": 0.06}])");
  const json keys = {{"1", "sphere"}, {"2", "cone"}, {"3", "cube"}};
  SameStudy study;
  study.one = {{"version", 1},
               {"name", "s"},
               {"renderers", {"point", "ray"}},
               {"stimuli", stimuli},
               {"seed", 8},
               {"orientation", json::parse(orientation)},
               {"repetitions", 5},
               {"response", {{"keys", keys}}}};
  study.two = study.one;
  study.two.erase("repetitions");
  study.two.erase("response");
  study.two["version"] = 2;
  const auto block = [&](const char* name, const json& renderers) {
    return json{{"name", name},           {"task", "identify"},
                {"renderers", renderers}, {"stimuli", {"sphere", "cone", "cube"}},
                {"repetitions", 5},       {"keys", keys}};
  };
  study.two["blocks"] = {block("with-point", {"point"}), block("with-ray", {"ray"})};
  study.two["block_order"] = "counterbalanced";
  return study;
}

void expect_equal_trials(const SameStudy& study) {
  const Protocol one = parsed(study.one), two = parsed(study.two);
  for (const int participant : {1, 2, 7}) {
    const std::vector<Trial> expected = schedule(one, participant);
    const std::vector<Trial> found = worked_off(SessionPlan(two, participant, 1));
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Trial &a = expected[i], &b = found[i];
      EXPECT_EQ(a.stimulus, b.stimulus) << "participant " << participant << ", trial " << i;
      EXPECT_EQ(a.renderer, b.renderer);
      EXPECT_EQ(a.orientation, b.orientation);
      EXPECT_EQ(std::tuple(a.session, a.block, a.trial, a.practice),
                std::tuple(b.session, b.block, b.trial, b.practice));
      ASSERT_EQ(b.intervals.size(), 1U);
      EXPECT_EQ(b.intervals[0].stimulus, a.stimulus);
      EXPECT_EQ(b.intervals[0].renderer, a.renderer);
    }
  }
}

TEST(SessionPlan, IdentifiesInTheOrderOfVersion1) {
  for (const char* orientation :
       {R"("uniform")", R"("fixed")", "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]"})
    expect_equal_trials(identification(orientation));
}

TEST(SessionPlan, IdentifiesUnderTheLimitsOfVersion1) {
  SameStudy study = identification(R"("uniform")");
  study.one["order"] = {{"max_run", 2}};
  for (json& block : study.two["blocks"]) block["order"] = {{"max_run", 2}};
  expect_equal_trials(study);
}

TEST(SessionPlan, IdentificationWithPracticeAndBlocksMatchesVersion1) {
  SameStudy study = identification(R"("uniform")");
  study.one["repetitions"] = 10;
  study.one["blocks_per_renderer"] = 2;
  study.one["renderer_order"] = "fixed";
  study.one["practice"] = {{"repetitions", 2}};
  study.two["block_order"] = "fixed";
  json blocks = json::array();
  for (json& block : study.two["blocks"]) {
    json practice = block;
    practice["name"] = "practice-" + block["name"].get<std::string>();
    practice["practice"] = true;
    practice["repetitions"] = 2;
    blocks.push_back(practice);
    for (const char* part : {"-a", "-b"}) {
      json half = block;
      half["name"] = block["name"].get<std::string>() + part;
      blocks.push_back(half);
    }
  }
  study.two["blocks"] = blocks;
  expect_equal_trials(study);
}

TEST(SessionPlan, IdentifiesWithMixedRenderersAsInVersion1) {
  SameStudy study = identification(R"("uniform")");
  study.one["renderer_order"] = "interleaved";
  json mixed = study.two["blocks"][0];
  mixed["renderers"] = {"point", "ray"};
  study.two["blocks"] = json::array({mixed});
  expect_equal_trials(study);
}

TEST(SessionPlan, IdentifiesSomeOfTheStimuli) {
  SameStudy study = identification(R"("uniform")");
  json& block = study.two["blocks"][0];
  block["stimuli"] = {"cube", "sphere"};
  block["keys"] = {{"1", "sphere"}, {"3", "cube"}};
  std::map<int, int> shown;
  for (const Trial& trial : worked_off(SessionPlan(parsed(study.two), 1, 1))) {
    if (trial.task_block == 0) ++shown[trial.stimulus];
  }
  EXPECT_EQ(shown, (std::map<int, int>{{0, 5}, {2, 5}}));
}

}  // namespace
}  // namespace palpate::protocols
