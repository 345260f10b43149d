// Translations of a protocol's texts.

#include "protocols/tasks/texts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

const std::string kPublished = PALPATE_SOURCE_DIR "/protocols/roughness-magnitude.json";

Protocol everything() {
  return parse_protocol(PALPATE_SOURCE_DIR "/tests/protocols/good/everything-v2.json");
}

std::vector<std::string> faults_of(const std::string& text) {
  Protocol protocol = everything();
  try {
    translate(protocol, "xx", text, "texts.xx.json");
  } catch (const InputError& error) {
    std::vector<std::string> places;
    for (const Fault& fault : error.faults()) places.push_back(fault.location);
    return places;
  }
  return {};
}

TEST(Texts, AreListedOnceEachAndTranslateToThemselves) {
  const Protocol protocol = everything();
  std::set<std::string> keys;
  for (const auto& [key, text] : texts_of(protocol)) {
    EXPECT_TRUE(keys.insert(key).second) << key;
    EXPECT_FALSE(text.empty()) << key;
  }
  for (const char* key :
       {"blocks.constant.instructions", "blocks.constant.keys.2", "blocks.scale.scale.2",
        "blocks.constant.confidence.question", "blocks.constant.confidence.scale.1",
        "pages.consent.text", "pages.who.items.age.question", "pages.who.items.tired.choices.2",
        "texts.agree", "texts.go"})
    EXPECT_TRUE(keys.contains(key)) << key;
  Protocol same = protocol;
  translate(same, "xx", texts_json(protocol), "texts.xx.json");
  EXPECT_EQ(texts_of(same), texts_of(protocol));
  EXPECT_EQ(same.sha256, protocol.sha256);
}

TEST(Texts, EachIsUnderItsKeyInTheFile) {
  const std::string path = PALPATE_SOURCE_DIR "/tests/protocols/good/everything-v2.json";
  std::ifstream in(path);
  json document = json::parse(in);
  for (auto& [name, text] : document["texts"].items()) text = "the " + name;
  const Protocol protocol = parse_protocol_text(document.dump(), path);
  std::map<std::string, std::string> found;
  for (const auto& [key, text] : texts_of(protocol)) found[key] = text;
  EXPECT_GE(document["texts"].size(), 16U);
  for (const auto& [name, text] : document["texts"].items())
    EXPECT_EQ(found["texts." + name], text) << name;
}

TEST(Texts, AreAllReplacedButStoredAnswersStay) {
  Protocol protocol = everything();
  json other;
  for (const auto& [key, text] : texts_of(protocol)) other[key] = "T " + key;
  translate(protocol, "xx", other.dump(), "texts.xx.json");
  for (const auto& [key, text] : texts_of(protocol)) EXPECT_EQ(text, "T " + key);
  const PageItem& hand = protocol.pages[1].items[1];
  EXPECT_EQ(hand.choices, (std::vector<std::string>{"links", "rechts"}));
  EXPECT_EQ(hand.shown.front(), "T pages.who.items.hand.choices.1");
  EXPECT_EQ(protocol.blocks[0].answers[1].name, "2");
  EXPECT_EQ(protocol.blocks[0].answers[1].label, "T blocks.constant.keys.2");
}

TEST(Texts, CellsHaveTheTextsThatTheirLevelsSet) {
  const std::string path = PALPATE_SOURCE_DIR "/tests/protocols/good/everything-v2.json";
  std::ifstream in(path);
  json document = json::parse(in);
  document["factors"][0]["levels"][1]["set"]["/block/question"] = "Is the wet one there?";
  for (json& block : document["blocks"]) {
    if (block["name"] == "find") block["question"] = "Is it there?";
  }
  Protocol protocol = parse_protocol_text(document.dump(), path);
  json texts = json::parse(texts_json(protocol));
  EXPECT_EQ(texts["blocks.find.question"], "Is it there?");
  const std::string own = "blocks.find.surface=wet.question";
  ASSERT_TRUE(texts.contains(own)) << texts.dump(1);
  texts["blocks.find.question"] = "Ist es da?";
  texts[own] = "Ist das nasse da?";
  texts["blocks.find.keys.yes"] = "ja";
  translate(protocol, "de", texts.dump(), "texts.de.json");
  int dry = 0, wet = 0;
  for (const TaskBlock& block : protocol.blocks) {
    if (block.name != "find") continue;
    dry += block.question == "Ist es da?";
    wet += block.question == "Ist das nasse da?";
    EXPECT_EQ(block.answers.front().label, "ja");
  }
  EXPECT_EQ(dry, 1);
  EXPECT_EQ(wet, 1);
}

TEST(Texts, NameEveryMissingUnknownOrWrongKey) {
  json texts = json::parse(texts_json(everything()));
  EXPECT_TRUE(faults_of(texts.dump()).empty());
  texts.erase("texts.go");
  texts.erase("pages.consent.text");
  texts["blocks.constant.question"] = 3;
  texts["blocks.constant.keys.2"] = "two\nlines";
  texts["blocks.which.keys.ball"] = "die";  // the label of the other one
  texts["blocks.nowhere.question"] = "?";
  std::vector<std::string> places = faults_of(texts.dump());
  std::sort(places.begin(), places.end());
  EXPECT_EQ(places,
            (std::vector<std::string>{"/blocks.constant.keys.2", "/blocks.constant.question",
                                      "/blocks.nowhere.question", "/blocks.which.keys.die",
                                      "/pages.consent.text", "/texts.go"}));
  EXPECT_EQ(faults_of("[]").size(), 1U);
  EXPECT_EQ(faults_of("{").size(), 1U);
}

TEST(Texts, PublishedProtocolHasItsTextsBesideIt) {
  Protocol protocol = parse_protocol(kPublished);
  translate(protocol, kPublished, "de");
  EXPECT_EQ(protocol.texts.go, "Los");
  EXPECT_EQ(protocol.language, "de");
  EXPECT_THROW(translate(protocol, kPublished, "tlh"), InputError);
}

TEST(Texts, ListBuiltInsBesideTheProtocolsWords) {
  Protocol protocol = parse_protocol(PALPATE_SOURCE_DIR "/protocols/quick.json");
  EXPECT_EQ(built_in_texts(protocol),
            (std::vector<std::string>{"texts.move_away", "texts.ready", "texts.go", "texts.wait",
                                      "texts.other_key"}));
  protocol.texts.go = "Los";
  protocol.texts.wait = "Bitte warten.";
  EXPECT_EQ(built_in_texts(protocol),
            (std::vector<std::string>{"texts.move_away", "texts.ready", "texts.other_key"}));
  protocol.texts = {};
  EXPECT_EQ(built_in_texts(protocol), std::vector<std::string>()) << "it is in English throughout";
  protocol.response.labels["cube"] = "W\u00fcrfel";
  EXPECT_EQ(built_in_texts(protocol).size(), 5U);
}

TEST(Texts, BuiltInTaskTextsAreThoseRead) {
  const Protocol all = everything();
  const std::vector<std::string> found = built_in_texts(all);
  const auto lists = [&](const std::string& key) {
    return std::find(found.begin(), found.end(), key) != found.end();
  };
  EXPECT_FALSE(lists("texts.go")) << "a question stands there";
  Protocol published = parse_protocol(kPublished);
  translate(published, kPublished, "de");
  EXPECT_EQ(built_in_texts(published), std::vector<std::string>());
  Protocol asks = parse_protocol_text(R"({"version": 2, "name": "x", "renderers": ["ray"],
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}],
    "blocks": [{"name": "is-it", "task": "detect", "stimuli": ["ball"], "repetitions": 2,
                "question": "Da?"}]})",
                                      "x.json");
  EXPECT_EQ(
      built_in_texts(asks),
      (std::vector<std::string>{"texts.move_away", "texts.ready", "texts.wait", "texts.other_key",
                                "blocks.is-it.keys.yes", "blocks.is-it.keys.no"}));
}

TEST(Texts, Version1HasItsTextsAndLabels) {
  Protocol protocol = parse_protocol(PALPATE_SOURCE_DIR "/protocols/quick.json");
  json texts = json::parse(texts_json(protocol));
  texts["response.keys.cube"] = "W\u00fcrfel";
  translate(protocol, "de", texts.dump(), "texts.de.json");
  EXPECT_EQ(answer_label(protocol, "cube"), "W\u00fcrfel");
}

}  // namespace
}  // namespace palpate::protocols
