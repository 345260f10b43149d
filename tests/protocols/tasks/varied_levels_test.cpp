// Levels in the stimuli that they vary.

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "protocols/tasks/levels.h"
#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

TEST(Levels, VariesAnyNumberOfAStimulus) {
  const Protocol protocol = parsed(task_study());
  const StimulusSpec stiff = at_level(protocol, protocol.blocks[0], 0, 512.5);
  EXPECT_EQ(stiff.object.material.stiffness, 512.5);
  EXPECT_EQ(stiff.object.radius, 0.03);
  const StimulusSpec deep = at_level(protocol, protocol.blocks[2], 1, 0.0071);
  EXPECT_EQ(deep.object.material.layers.at(0).depth, 0.0071);
  EXPECT_EQ(deep.object.material.layers.at(0).stiffness, 300);
  EXPECT_EQ(own_level(protocol, protocol.blocks[0], 0), 300);
}

TEST(Levels, TurnsAboutAnAxisInDegrees) {
  json document = task_study();
  document["blocks"][0]["level"] = {{"path", "/orientation"}, {"axis", {0, 0, 2}}};
  const Protocol protocol = parsed(document);
  const Quat turned = at_level(protocol, protocol.blocks[0], 0, 90).object.pose.orientation;
  EXPECT_NEAR(turned.w, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(turned.z, std::sqrt(0.5), 1e-15);
}

TEST(Levels, HoldsEveryLevelThatABlockMayShow) {
  const Protocol protocol = parsed(task_study());
  const Protocol all = with_all_levels(protocol);
  std::set<std::string> names;
  for (const StimulusSpec& stimulus : all.stimuli) EXPECT_TRUE(names.insert(stimulus.name).second);
  for (const char* name : {"soft", "lump", "soft at 200", "soft at 400", "soft at 400 (stairs)",
                           "soft at 600", "lump at 0.008"})
    EXPECT_EQ(names.count(name), 1U) << name;
  EXPECT_EQ(
      with_all_levels(parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000.json")).stimuli.size(),
      4U);
}

}  // namespace
}  // namespace palpate::protocols
