#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "protocols/json_document.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

struct ReadProcedure {
  std::optional<ProcedureSpec> spec;
  std::vector<std::string> places;  // of its faults
};

ReadProcedure read_text(const std::string& text) {
  FaultList faults("p.json");
  const nlohmann::json value = read_json(text, faults);
  ObjectReader reader(value, "", faults);
  ReadProcedure read{read_procedure(reader), {}};
  try {
    faults.throw_if_any();
  } catch (const InputError& error) {
    for (const Fault& fault : error.faults()) read.places.push_back(fault.location);
  }
  return read;
}

using Places = std::vector<std::string>;

TEST(ParseProcedure, ReadsEveryExampleOfTheReadme) {
  std::ifstream file(PALPATE_SOURCE_DIR "/protocols/README.md");
  std::stringstream readme;
  readme << file.rdbuf();
  const std::string text = readme.str();
  const std::size_t section = text.find("## Reference: how levels are chosen");
  const std::size_t begin = text.find("```json\n", section) + 8;
  const std::string examples = text.substr(begin, text.find("```", begin) - begin);
  int count = 0;
  for (std::size_t from = 0; from != std::string::npos;) {
    const std::size_t next = examples.find("\n{\"kind\"", from);
    const ReadProcedure read = read_text(examples.substr(from, next - from));
    EXPECT_TRUE(read.spec.has_value()) << examples.substr(from, next - from);
    ++count;
    from = next == std::string::npos ? next : next + 1;
  }
  EXPECT_EQ(count, 6);
}

TEST(ParseProcedure, ReadsAStaircaseWithItsDefaults) {
  const auto read = read_text(
      R"({"kind": "staircase", "start": 5, "min": 1, "max": 10, "steps": 0.5, "target": 0.75,
          "stop": {"reversals": 12}, "easier": "lower"})");
  ASSERT_TRUE(read.spec.has_value());
  const auto& spec = std::get<Staircase>(*read.spec);
  EXPECT_EQ(spec.steps, std::vector<double>{0.5});
  EXPECT_NEAR(spec.step_ratio, 3, 1e-12);
  EXPECT_EQ(spec.easier, Easier::lower);
  EXPECT_EQ(spec.stop_reversals, 12);
  EXPECT_EQ(spec.stop_trials, 200);
  EXPECT_EQ(levels_to_check(*read.spec), (std::vector<double>{1, 5, 10}));
}

TEST(ParseProcedure, GridsAreListsOrRangesWithWeights) {
  const auto read = read_text(
      R"({"kind": "quest_plus", "function": "normal", "scale": "log", "guess": 0.5,
          "levels": {"from": 1, "to": 100, "count": 3, "spacing": "log"},
          "threshold": {"values": [2, 3], "weights": [1, 4]}, "slope": [1, 2],
          "stop": {"trials": 40, "entropy_bits": 1}})");
  ASSERT_TRUE(read.spec.has_value());
  const auto& spec = std::get<QuestPlus>(*read.spec);
  EXPECT_EQ(spec.levels, (std::vector<double>{1, 10, 100}));
  EXPECT_EQ(spec.threshold.weights, (std::vector<double>{1, 4}));
  EXPECT_EQ(spec.lapse.values, std::vector<double>{0.02});
  EXPECT_EQ(spec.stop_entropy_bits, 1);
}

TEST(ParseProcedure, NamesThePlaceOfEveryFault) {
  const std::pair<const char*, Places> bad[] = {
      {R"({"kind": "stairs"})", {"/kind"}},
      {R"({})", {"/kind"}},
      {R"([])", {"/"}},
      {R"({"kind": "constant"})", {"/levels", "/repetitions"}},
      {R"({"kind": "constant", "levels": [1, 2, 1], "repetitions": 0.5})",
       {"/levels/2", "/repetitions"}},
      {R"({"kind": "constant", "levels": [1, "2"], "repetitions": 1, "scale": "log"})",
       {"/levels/1", "/scale"}},
      {R"({"kind": "staircase", "start": 0, "min": 1, "max": 10, "steps": [1, 0], "stop": {}})",
       {"/start", "/steps/1", "/stop"}},
      {R"({"kind": "staircase", "start": 5, "min": 10, "max": 1, "steps": 1,
           "stop": {"reversals": 6}, "discard_reversals": 5})",
       {"/discard_reversals", "/max"}},
      {R"({"kind": "staircase", "start": 5, "min": 0, "max": 10, "steps": 1, "scale": "db",
           "stop": {"trials": 6}, "target": 0.7, "step_ratio": 2})",
       {"/min", "/target"}},
      {R"({"kind": "staircase", "start": 5, "min": 1, "max": 10, "steps": 1, "up": 2,
           "stop": {"trials": 6}, "target": 0.7})",
       {"/target"}},
      {R"({"kind": "quest_plus", "function": "weibull", "levels": [1, 2], "threshold": [1, 2],
           "slope": [0, 1], "guess": 0.5, "lapse": 0.5, "stop": {"trials": 9, "entropy_bits": 7}})",
       {"/function", "/lapse", "/slope/0", "/stop/entropy_bits"}},
      {R"({"kind": "quest_plus", "function": "normal", "levels": {"from": 1, "to": 9, "count": 900},
           "threshold": {"from": 1, "to": 9, "count": 900}, "slope": {"from": 9, "to": 1, "count": 4},
           "guess": {"from": 0, "to": 0.9, "count": 90, "spacing": "log"},
           "lapse": {"values": [0, 0.01], "weights": [1, 2, 3]}, "stop": {"trials": 5}})",
       {"/guess/from", "/lapse/weights", "/slope/to"}},
      {R"({"kind": "quest_plus", "function": "normal", "levels": {"from": 1, "to": 9, "count": 900},
           "threshold": {"from": 1, "to": 9, "count": 900}, "slope": [1, 2, 3, 4, 5],
           "guess": 0, "stop": {"trials": 5}})",
       {"/threshold"}},
      {R"({"kind": "limits", "low": 1, "high": 1, "step": 1})", {"/high"}},
      {R"({"kind": "limits", "low": 0, "high": 10, "step": 0.001})", {"/step"}},
      {R"({"kind": "limits", "low": 0, "high": 3, "step": 1, "jitter_steps": 3})", {"/step"}},
      {R"({"kind": "limits", "low": 0, "high": 3, "step": 1, "serie": 3})", {"/serie"}},
      {R"({"kind": "ask", "min": 2, "max": 1, "stop": {"trials": 5}})", {"/max"}},
      {R"({"kind": "ask", "min": 0, "max": 1, "scale": "log", "stop": {"trials": 5}})", {"/min"}},
      {R"({"kind": "ask", "min": 1, "max": 2})", {"/stop"}},
      {R"({"kind": "ask", "min": 1, "max": 2, "stop": {"trials": 0}, "start": 1})",
       {"/start", "/stop/trials"}},
  };
  for (const auto& [text, places] : bad) {
    ReadProcedure read = read_text(text);
    std::sort(read.places.begin(), read.places.end());
    EXPECT_EQ(read.places, places) << text;
    EXPECT_FALSE(read.spec.has_value()) << text;
  }
}

}  // namespace
}  // namespace palpate::protocols
