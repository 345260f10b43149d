#include "protocols/difference.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace palpate::protocols {
namespace {

using nlohmann::json;
using Pointers = std::vector<std::string>;

const json kProtocol = json::parse(R"({"version": 1, "name": "p", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02},
              {"name": "box", "shape": "cube", "edge_m": 0.03}],
  "repetitions": 4, "texts": {"break": "rest", "a/b": "x"}, "seed": 1,
  "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 30}})");

/// Between the protocol and its version after `patch` (RFC 7386).
ProtocolDifference after(const char* patch) {
  json changed = kProtocol;
  changed.merge_patch(json::parse(patch));
  const ProtocolDifference there = difference(kProtocol.dump(), changed.dump(2));
  const ProtocolDifference back = difference(changed.dump(), kProtocol.dump());
  EXPECT_EQ(there.texts, back.texts);
  EXPECT_EQ(there.design, back.design);
  EXPECT_EQ(there.settings, back.settings);
  return there;
}

TEST(ProtocolDifference, LayoutIsNotADifference) {
  const ProtocolDifference same = after(R"({"seed": 1.0})");
  EXPECT_TRUE(same.nothing());
  EXPECT_EQ(in_words(same), "only its layout");
}

TEST(ProtocolDifference, TextsAreReportedApart) {
  const ProtocolDifference texts = after(
      R"({"title": "new", "description": "d", "$schema": "s", "texts": {"break": "sit", "end": "!"},
          "response": {"keys": {"1": {"stimulus": "ball", "label": "Kugel"}}}})");
  EXPECT_TRUE(texts.only_texts());
  EXPECT_EQ(texts.texts, (Pointers{"/$schema", "/description", "/response/keys/1/label",
                                   "/texts/break", "/texts/end", "/title"}));
  EXPECT_EQ(in_words(after(R"({"texts": {"break": "sit"}})")), "only texts: /texts/break");
  EXPECT_EQ(after(R"({"texts": null})").texts, Pointers{"/texts"});
  EXPECT_EQ(after(R"({"texts": {"a/b": "y"}})").texts, Pointers{"/texts/a~1b"});
}

TEST(ProtocolDifference, StimuliAndOrderAreDesign) {
  for (const auto& [patch, pointer] : std::map<const char*, const char*>{
           {R"({"seed": 2})", "/seed"},
           {R"({"repetitions": 5})", "/repetitions"},
           {R"({"renderers": ["ray"]})", "/renderers/0"},
           {R"({"renderers": ["point", "ray"]})", "/renderers/1"},
           {R"({"renderer_order": "fixed"})", "/renderer_order"},
           {R"({"order": {"max_run": 3}})", "/order"},
           {R"({"blocks_per_renderer": 2})", "/blocks_per_renderer"},
           {R"({"orientation": "fixed"})", "/orientation"},
           {R"({"practice": {"repetitions": 1}})", "/practice"},
           {R"({"sessions": {"count": 2}})", "/sessions"},
           {R"({"material": {"stiffness_n_per_m": 300}})", "/material"}}) {
    const ProtocolDifference design = after(patch);
    EXPECT_FALSE(design.only_texts()) << patch;
    EXPECT_EQ(design.design, Pointers{pointer}) << patch;
    EXPECT_TRUE(design.texts.empty() && design.settings.empty()) << patch;
  }
  json bigger = kProtocol;
  bigger["stimuli"][0]["radius_m"] = 0.03;
  bigger["texts"]["break"] = "sit";
  const ProtocolDifference both = difference(kProtocol.dump(), bigger.dump());
  EXPECT_FALSE(both.only_texts());
  EXPECT_EQ(in_words(both), "stimuli and order: /stimuli/0/radius_m; texts: /texts/break");
}

TEST(ProtocolDifference, AllElseIsASetting) {
  const ProtocolDifference other =
      after(R"({"response": {"time_out_s": 20, "keys": {"1": "box", "2": "ball"}}, "home": {},
                "samples": true})");
  EXPECT_FALSE(other.only_texts());
  EXPECT_EQ(in_words(other),
            "other settings: /home, /response/keys/1/stimulus, /response/keys/2/stimulus, "
            "/response/time_out_s, /samples");
}

TEST(ProtocolDifference, ALongListIsCut) {
  json more = kProtocol;
  for (int i = 0; i < 12; ++i) more["texts"]["t" + std::to_string(10 + i)] = "x";
  EXPECT_TRUE(
      in_words(difference(kProtocol.dump(), more.dump())).ends_with("/texts/t17 and 4 more"));
}

}  // namespace
}  // namespace palpate::protocols
