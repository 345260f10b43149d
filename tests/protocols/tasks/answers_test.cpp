// Answers of tasks: defaults, chosen keys and labels, scales, and refusals.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {
namespace answering {

using nlohmann::json;

/// A block of an otherwise valid protocol, with `more` merged into it.
json document(const std::string& task, const json& more) {
  json block{{"name", "b"}, {"task", task}, {"stimuli", {"ball"}}};
  if (task == "compare") block["standard"] = "ball";
  if (task == "compare" || task == "detect") {
    block["level"] = {{"path", "/stiffness_n_per_m"}};
    block["procedure"] = {{"kind", "constant"}, {"levels", {200, 400}}, {"repetitions", 2}};
  }
  if (task == "rate") block["repetitions"] = 2;
  block.update(more);
  return {{"version", 2},
          {"name", "base"},
          {"renderers", {"ray"}},
          {"stimuli",
           {{{"name", "ball"}, {"shape", "sphere"}, {"radius_m", 0.02}},
            {{"name", "die"}, {"shape", "cube"}, {"edge_m", 0.04}}}},
          {"blocks", {block}}};
}

std::vector<std::string> faults_of_block(const std::string& task, const json& more) {
  std::vector<std::string> found;
  try {
    parse_protocol_text(document(task, more).dump(), "p.json");
  } catch (const InputError& error) {
    for (const Fault& fault : error.faults()) found.push_back(fault.location);
  }
  return found;
}

/// "key name label", ...
std::vector<std::string> answers_of_block(const std::string& task, const json& more) {
  const Protocol protocol = parse_protocol_text(document(task, more).dump(), "p.json");
  std::vector<std::string> all;
  for (const TaskAnswer& answer : protocol.blocks.at(0).answers)
    all.push_back(answer.key + " " + answer.name + " " + answer.label);
  return all;
}

using Places = std::vector<std::string>;

TEST(Answers, AdjustmentsHaveTurnsSwitchAndDone) {
  const std::vector<std::string> all =
      answers_of_block("adjust", {{"standard", "ball"},
                                  {"level", {{"path", "/stiffness_n_per_m"}}},
                                  {"min", 100},
                                  {"max", 500},
                                  {"turn", 50},
                                  {"starts", {200}},
                                  {"repetitions", 2}});
  ASSERT_EQ(all.size(), 4U);
  EXPECT_TRUE(all[0].ends_with(" down -")) << all[0];
  EXPECT_TRUE(all[1].ends_with(" up +")) << all[1];
  EXPECT_TRUE(all[2].ends_with(" switch switch")) << all[2];
  EXPECT_TRUE(all[3].ends_with(" done done")) << all[3];
}

TEST(Answers, AreNumberedInOrderByDefault) {
  EXPECT_EQ(answers_of_block("compare", json::object()), (Places{"1 1 1", "2 2 2"}));
  EXPECT_EQ(answers_of_block("compare", {{"intervals", 3}}), (Places{"1 1 1", "2 2 2", "3 3 3"}));
}

TEST(Answers, KeysAndLabelsCanBeChosen) {
  EXPECT_EQ(answers_of_block("compare", {{"keys", {{"z", "1"}, {"a", "2"}}}}),
            (Places{"a 2 2", "z 1 1"}))
      << "in the order of the keys";
  EXPECT_EQ(answers_of_block("compare", {{"keys",
                                          {{"left", {{"answer", "1"}, {"label", "erstes"}}},
                                           {"right", {{"answer", "2"}}}}}}),
            (Places{"left 1 erstes", "right 2 2"}));
}

TEST(Answers, EachHasOneKeyAndOneLabel) {
  const std::string keys = "/blocks/0/keys";
  EXPECT_EQ(faults_of_block("compare", {{"keys", {{"a", "1"}}}}), Places{keys}) << "none for 2";
  EXPECT_EQ(faults_of_block("compare", {{"keys", {{"a", "1"}, {"b", "1"}, {"c", "2"}}}}),
            Places{keys + "/b"});
  EXPECT_EQ(faults_of_block("compare", {{"keys",
                                         {{"a", {{"answer", "1"}, {"label", "x"}}},
                                          {"b", {{"answer", "2"}, {"label", "x"}}}}}}),
            Places{keys});
  EXPECT_EQ(faults_of_block("compare", {{"keys", {"1", "2"}}}), Places{keys}) << "no object";
  for (const char* taken : {"space", "enter", "escape"})
    EXPECT_EQ(faults_of_block("compare", {{"keys", {{taken, "1"}, {"b", "2"}}}}),
              (Places{keys + "/" + taken}));
}

TEST(Answers, KeysAndLabelsAreShortAndPlain) {
  const auto with_label = [](const std::string& label) {
    return faults_of_block("compare",
                           {{"keys", {{"a", {{"answer", "1"}, {"label", label}}}, {"b", "2"}}}});
  };
  EXPECT_EQ(with_label("x"), Places{});
  EXPECT_EQ(with_label(std::string(80, 'x')), Places{});
  EXPECT_EQ(with_label("größer ~"), Places{});
  for (const std::string& wrong : {std::string(), std::string(81, 'x'), std::string("a\nb"),
                                   std::string("\x7f"), std::string("\x1f")})
    EXPECT_EQ(with_label(wrong), Places{"/blocks/0/keys/a/label"}) << wrong;
  const auto with_key = [](const std::string& key) {
    return faults_of_block("compare", {{"keys", {{key, "1"}, {"b", "2"}}}});
  };
  EXPECT_EQ(with_key("k"), Places{});
  EXPECT_EQ(with_key(std::string(32, 'k')), Places{"/blocks/0/keys/" + std::string(32, 'k')});
  EXPECT_EQ(with_key(std::string(33, 'k')), Places{"/blocks/0/keys/" + std::string(33, 'k')});
  EXPECT_EQ(with_key(""), Places{"/blocks/0/keys/"});
  EXPECT_EQ(with_key("\t"), Places{"/blocks/0/keys/\t"});
}

json scale_of(std::size_t steps) {
  json scale = json::array();
  for (std::size_t i = 1; i <= steps; ++i)
    scale.push_back({{"label", "step " + std::to_string(i)}});
  return scale;
}

TEST(Answers, ScaleStepsHaveKeyboardKeys) {
  EXPECT_EQ(
      answers_of_block("rate", {{"scale", scale_of(11)}}),
      (Places{"1 1 step 1", "2 2 step 2", "3 3 step 3", "4 4 step 4", "5 5 step 5", "6 6 step 6",
              "7 7 step 7", "8 8 step 8", "9 9 step 9", "0 0 step 10", "a a step 11"}));
  const auto read = parse_protocol_text(document("rate", {{"scale",
                                                           {{{"label", "none"}, {"number", 0}},
                                                            {{"label", "some"}, {"number", 2.5}},
                                                            {{"label", "much"}}}}})
                                            .dump(),
                                        "p.json");
  const auto& answers = read.blocks.at(0).answers;
  ASSERT_EQ(answers.size(), 3U);
  EXPECT_EQ(answers[0].number, 0);
  EXPECT_EQ(answers[1].number, 2.5);
  EXPECT_EQ(answers[2].number, 3) << "without a number, its place";
}

TEST(Answers, ScalesRiseAndHaveTwoToElevenLabels) {
  const std::string scale = "/blocks/0/scale";
  EXPECT_EQ(faults_of_block("rate", {{"scale", scale_of(2)}}), Places{});
  EXPECT_EQ(faults_of_block("rate", {{"scale", scale_of(1)}}), Places{scale});
  EXPECT_EQ(faults_of_block("rate", {{"scale", scale_of(12)}}), Places{scale});
  EXPECT_EQ(faults_of_block("rate", {{"scale", scale_of(2)}, {"min", 0}}), Places{scale});
  EXPECT_EQ(faults_of_block("rate", {{"scale", scale_of(2)}, {"max", 0}}), Places{scale});
  EXPECT_EQ(faults_of_block("rate", {{"min", 0}, {"max", 10}}), Places{});
  EXPECT_EQ(faults_of_block("rate", {{"min", 10}, {"max", 10}}), Places{"/blocks/0/max"});
  EXPECT_EQ(
      faults_of_block(
          "rate", {{"scale", {{{"label", "a"}, {"number", 2}}, {{"label", "b"}, {"number", 2}}}}}),
      Places{scale + "/1/number"});
  EXPECT_EQ(faults_of_block("rate", {{"scale", {{{"label", "a"}}, {{"number", 2}}}}}),
            Places{scale + "/1/label"});
}

TEST(Answers, StepsOfAScaleHaveNoOtherKeys) {
  const json steps = {{{"label", "low"}}, {{"label", "high"}, {"lable", "high"}}};
  EXPECT_EQ(faults_of_block("rate", {{"scale", steps}}), Places{"/blocks/0/scale/1/lable"});
}

TEST(Answers, ConfidenceHasAScale) {
  EXPECT_EQ(faults_of_block("compare", {{"confidence", {{"scale", scale_of(4)}}}}), Places{});
  EXPECT_EQ(faults_of_block("compare", {{"confidence", json::object()}}),
            Places{"/blocks/0/confidence/scale"});
  const auto protocol = parse_protocol_text(
      document("compare", {{"confidence", {{"question", "Sure?"}, {"scale", scale_of(3)}}}}).dump(),
      "p.json");
  const auto& confidence = protocol.blocks.at(0).confidence;
  ASSERT_TRUE(confidence.has_value());
  EXPECT_EQ(confidence->question, "Sure?");
  ASSERT_EQ(confidence->scale.size(), 3U);
  EXPECT_EQ(confidence->scale[2].number, 3);
  EXPECT_EQ(confidence->scale[2].label, "step 3");
}

}  // namespace answering
}  // namespace
}  // namespace palpate::protocols
