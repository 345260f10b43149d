// The levels that a block can show, a stimulus's own level, and units and texts of levels.

#include "protocols/tasks/levels.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {
namespace levels_by_hand {

using nlohmann::json;

Protocol protocol_with(const json& block, const json& ball = json::object()) {
  json stimulus{{"name", "ball"}, {"shape", "sphere"}, {"radius_m", 0.02}};
  stimulus.update(ball);
  return parse_protocol_text(json{{"version", 2},
                                  {"name", "base"},
                                  {"renderers", {"ray"}},
                                  {"stimuli", {stimulus}},
                                  {"blocks", {block}}}
                                 .dump(),
                             "p.json");
}

json adjust(double least, double most, const std::string& path = "/stiffness_n_per_m") {
  return {{"name", "b"},
          {"task", "adjust"},
          {"stimuli", {"ball"}},
          {"standard", "ball"},
          {"min", least},
          {"level", {{"path", path}}},
          {"max", most},
          {"turn", (most - least) / 10},
          {"starts", {most, least + 0.25 * (most - least)}}};
}

json compare(const json& procedure) {
  return {{"name", "b"},
          {"task", "compare"},
          {"stimuli", {"ball"}},
          {"standard", "ball"},
          {"level", {{"path", "/stiffness_n_per_m"}}},
          {"procedure", procedure}};
}

using Levels = std::vector<double>;

TEST(Levels, AdjustmentsHaveEndsAndStarts) {
  EXPECT_EQ(levels_of(protocol_with(adjust(100, 500)).blocks[0]), (Levels{100, 200, 500}));
}

TEST(Levels, ConstantStimuliAppearOnceInOrder) {
  const auto protocol = protocol_with(
      compare({{"kind", "constant"}, {"levels", {400, 200, 300}}, {"repetitions", 2}}));
  EXPECT_EQ(levels_of(protocol.blocks[0]), (Levels{200, 300, 400}));
}

/// A sphere has a positive and limited size.
TEST(Levels, AdjustmentsReachOnlyLevelsTheStimulusAllows) {
  const auto is_refused = [](double least, double most) {
    try {
      protocol_with(adjust(least, most, "/radius_m"));
    } catch (const InputError&) {
      return true;
    }
    return false;
  };
  EXPECT_FALSE(is_refused(0.01, 0.03));
  EXPECT_TRUE(is_refused(0, 0.03));
  EXPECT_TRUE(is_refused(-0.01, 0.03));
  EXPECT_TRUE(is_refused(0.01, 1e6));
}

TEST(Levels, StimuliHaveTheirOwnOrMaterialsDefault) {
  const auto own = [](const json& ball, const std::string& path) {
    const Protocol protocol = protocol_with(adjust(0.01, 0.03, "/radius_m"), ball);
    TaskBlock block = protocol.blocks[0];
    block.level->pointer = path;
    return own_level(protocol, block, 0);
  };
  EXPECT_EQ(own(json::object(), "/radius_m"), 0.02);
  EXPECT_EQ(own(json::object(), "/stiffness_n_per_m"), 800) << "the documented default";
  EXPECT_EQ(own({{"stiffness_n_per_m", 300}}, "/stiffness_n_per_m"), 300);
  EXPECT_EQ(own({{"damping_ns_per_m", 1.5}}, "/damping_ns_per_m"), 1.5);
  EXPECT_EQ(own(json::object(), "/damping_ns_per_m"), 0);
  EXPECT_EQ(own({{"friction_static", 0.4}, {"friction_dynamic", 0.3}}, "/friction_static"), 0.4);
  EXPECT_EQ(own({{"friction_static", 0.4}, {"friction_dynamic", 0.3}}, "/friction_dynamic"), 0.3);
  EXPECT_EQ(own(json::object(), "/height_m"), std::nullopt);
}

}  // namespace levels_by_hand
TEST(LevelName, IsTheNumbersNameWithoutItsUnit) {
  EXPECT_EQ(level_name("/stiffness_n_per_m"), "stiffness");
  EXPECT_EQ(level_name("/size_m/0"), "size");
  EXPECT_EQ(level_name("/layers/1/break_n"), "break");
  EXPECT_EQ(level_name("/friction"), "friction");
  EXPECT_EQ(level_name("/body/damping_per_s"), "damping");
  EXPECT_EQ(level_name("/contact_transient/frequency_hz"), "frequency");
}

}  // namespace
}  // namespace palpate::protocols
