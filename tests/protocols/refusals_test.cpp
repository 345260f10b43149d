// Refusals state the expectation in whole sentences, and in some cases the reason.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "tests/protocols/parsed_faults.h"
#include "tests/shared/prose.h"

namespace palpate::protocols {
namespace {
namespace refusals {

namespace fs = std::filesystem;

std::vector<Fault> faults_of_scene(const std::string& text) {
  return faults_when([&] { parse_scene_text(text, "s.json"); });
}

TEST(Refusals, AreWholeSentencesWithAnExpectation) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(PALPATE_SOURCE_DIR "/tests/protocols/bad")) {
    if (entry.path().extension() != ".json") continue;
    for (const Fault& fault : faults_when([&] { parse_file(entry.path()); })) {
      ++count;
      const std::string& text = fault.expected;
      SCOPED_TRACE(entry.path().filename().string() + " " + fault.location + ": " + text);
      ASSERT_GE(text.size(), 12U);
      EXPECT_EQ(palpate::testing::flaw_of(text), "");
      // The expectation, or the key concerned; else a sentence with a verb.
      bool says = false;
      for (const char* word : {"expected ", "missing; ", "unknown key; ", "at most ", "cannot be ",
                               " needs ", "no key for ", "is the same "})
        says = says || text.find(word) != std::string::npos;
      EXPECT_TRUE(says);
    }
  }
  EXPECT_GT(count, 250);
}

TEST(Refusals, ThickToolsAndSoftObjectsNeedEachOther) {
  const auto refusal = [](double radius, const std::string& object) {
    const std::vector<Fault> faults =
        faults_of_scene(R"({"objects": [{"shape": "cube", "edge_m": 0.05)" + object +
                        R"(}], "tool": {"radius_m": )" + std::to_string(radius) +
                        R"(, "segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.1]}]}})");
    return faults.empty() ? std::string() : faults.at(0).location + ": " + faults.at(0).expected;
  };
  const std::string soft = R"(, "soft": {"young_pa": 20000})";
  EXPECT_EQ(refusal(0, ""), "");
  EXPECT_EQ(refusal(0.002, soft), "");
  const std::string thick = refusal(0.002, ""), thin = refusal(0.0001, soft);
  for (const char* part : {"/tool/radius_m: expected 0", "rigid", "without thickness"})
    EXPECT_NE(thick.find(part), std::string::npos) << thick;
  for (const char* part : {"/tool/radius_m: expected 0.0005 to 0.05 m", "soft"})
    EXPECT_NE(thin.find(part), std::string::npos) << thin;
}

}  // namespace refusals
}  // namespace
}  // namespace palpate::protocols
