// Crossed factors within participants: cells, their stimuli, orders and tracks.

#include "protocols/factors.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>
#include <string>

#include "data/base/cell_name.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/block_procedures.h"
#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {
namespace factors {

using nlohmann::json;

/// The study of three blocks; `block` crosses surface (2) and size (3).
json crossed_study(const std::string& block, const char* mixing = "mixed") {
  json study = task_study();
  study["factors"] = json::parse(R"([
    {"name": "surface", "levels": [{"name": "smooth", "set": {}},
                                   {"name": "rough", "set": {"/stimuli/*/friction_static": 0.5}}]},
    {"name": "size", "levels": [{"name": "s", "set": {"/stimuli/*/radius_m": 0.02}},
                                {"name": "m", "set": {}},
                                {"name": "l", "set": {"/stimuli/soft/radius_m": 0.04}}]}])");
  for (json& one : study["blocks"]) {
    if (one["name"] != block) continue;
    one["factors"] = {"size", "surface"};
    one["mixing"] = mixing;
    one.erase("order");
  }
  return study;
}

const StimulusSpec& shown(const Protocol& protocol, const Interval& interval) {
  return protocol.stimuli[static_cast<std::size_t>(interval.stimulus)];
}

std::vector<Trial> of_block(const Protocol& protocol, int participant, const std::string& name) {
  std::vector<Trial> out;
  for (const Trial& trial : worked_off(SessionPlan(protocol, participant, 1))) {
    if (block_of(protocol, trial).name == name) out.push_back(trial);
  }
  return out;
}

std::vector<std::string> faults_of(const json& study) {
  std::vector<std::string> out;
  try {
    parsed(study);
  } catch (const InputError& error) {
    for (const Fault& fault : error.faults()) out.push_back(fault.location);
  }
  return out;
}

TEST(CellName, SplitsWhatItJoins) {
  const CellName name{"soft", {{"surface", "rough"}, {"size", "s"}}};
  EXPECT_EQ(name.text(), "soft[surface=rough,size=s]");
  EXPECT_EQ(cell_name(name.text()).levels, name.levels);
  EXPECT_EQ(cell_name(name.text()).level("size"), "s");
  EXPECT_EQ(base_name("soft"), "soft");
  EXPECT_EQ(cell_name("odd[]").levels.size(), 0U);
  EXPECT_EQ(cell_name("a[b=c").base, "a[b=c") << "a name of somebody else";
}

TEST(Factors, EveryCellIsShownEquallyOften) {
  const Protocol protocol = parsed(crossed_study("constant"));
  EXPECT_EQ(cells_of(protocol.blocks[0]), 6U);
  for (const int participant : {1, 2, 5}) {
    std::map<std::pair<std::string, double>, int> count;
    for (const Trial& trial : of_block(protocol, participant, "constant"))
      ++count[{protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name, *trial.level}];
    EXPECT_EQ(count.size(), 6U * 4);
    for (const auto& [cell, n] : count) EXPECT_EQ(n, 6) << cell.first;
  }
}

TEST(Factors, SetTheStandardAndTheComparison) {
  const Protocol protocol = parsed(crossed_study("constant"));
  std::set<std::string> seen;
  for (const Trial& trial : of_block(protocol, 1, "constant")) {
    ASSERT_EQ(trial.intervals.size(), 2U);
    const StimulusSpec &a = shown(protocol, trial.intervals[0]),
                       &b = shown(protocol, trial.intervals[1]);
    EXPECT_EQ(cell_name(a.name).levels, cell_name(b.name).levels);
    const CellName cell = cell_name(a.name);
    EXPECT_EQ(a.object.material.friction_static, cell.level("surface") == "rough" ? 0.5 : 0);
    const double radius = cell.level("size") == "s"   ? 0.02
                          : cell.level("size") == "m" ? 0.03
                                                      : 0.04;
    EXPECT_EQ(a.object.radius, radius);
    EXPECT_EQ(b.object.radius, radius);
    EXPECT_EQ(a.place, 0U);
    seen.insert(a.name);
  }
  EXPECT_EQ(seen.size(), 6U);
}

TEST(Factors, ChangeOneBlockOnly) {
  for (const char* const mixing : {"mixed", "blocked"}) {
    const Protocol plain = parsed(task_study()),
                   crossed = parsed(crossed_study("constant", mixing));
    const auto before = of_block(plain, 3, "lumps"), after = of_block(crossed, 3, "lumps");
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(before[i].level, after[i].level);
      EXPECT_EQ(before[i].catch_trial, after[i].catch_trial);
      EXPECT_EQ(before[i].track, after[i].track);
    }
    EXPECT_EQ(track_order(plain, 3, 1, 2),
              track_order(crossed, 3, static_cast<int>(crossed.blocks.size()) - 2, 2));
  }
}

TEST(Factors, CellsApartFollowWilliamsSquare) {
  const Protocol protocol = parsed(crossed_study("constant", "blocked"));
  ASSERT_EQ(protocol.blocks.size(), 6U + 2);
  std::map<std::pair<std::string, int>, int> places;
  std::map<std::pair<std::string, std::string>, int> follows;
  for (int participant = 1; participant <= 6; ++participant) {
    std::vector<std::string> order;
    for (const Trial& trial : of_block(protocol, participant, "constant")) {
      const std::string& name = protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
      if (order.empty() || order.back() != name) order.push_back(name);
    }
    ASSERT_EQ(order.size(), 6U) << "cell after cell";
    for (int i = 0; i < 6; ++i) {
      ++places[{order[static_cast<std::size_t>(i)], i}];
      if (i > 0)
        ++follows[{order[static_cast<std::size_t>(i) - 1], order[static_cast<std::size_t>(i)]}];
    }
  }
  EXPECT_EQ(places.size(), 36U);
  EXPECT_EQ(follows.size(), 30U);
  EXPECT_EQ(block_orders(protocol), 6);
}

TEST(Factors, OrdersOfCellsMeetAllOrdersOfBlocks) {
  json study = crossed_study("constant", "blocked");
  study["block_order"] = "counterbalanced";
  const Protocol protocol = parsed(study);
  std::map<std::pair<std::string, std::string>, int> pairs;
  const int period = block_orders(protocol);
  for (int participant = 1; participant <= period; ++participant) {
    std::string blocks, cells;
    for (const Trial& trial : worked_off(SessionPlan(protocol, participant, 1))) {
      const std::string& name = block_of(protocol, trial).name;
      const std::string& stimulus = shown(protocol, {trial.stimulus, trial.renderer}).name;
      if (!trial.practice && !blocks.ends_with(name)) blocks += "," + name;
      if (name == "constant" && !cells.ends_with(stimulus)) cells += stimulus;
    }
    ++pairs[{blocks, cells}];
  }
  std::set<std::string> blocks, cells;
  for (const auto& [pair, count] : pairs) {
    blocks.insert(pair.first);
    cells.insert(pair.second);
    EXPECT_EQ(count, pairs.begin()->second);
  }
  EXPECT_EQ(cells.size(), 6U);
  EXPECT_GT(blocks.size(), 1U);
  EXPECT_EQ(pairs.size(), blocks.size() * cells.size());
}

TEST(Factors, TracksOfCellsAreTheirOwn) {
  for (const char* const mixing : {"mixed", "blocked"}) {
    const Protocol protocol = parsed(crossed_study("stairs", mixing));
    const BlockProcedures procedures =
        procedures_of_blocks(protocol.source_text, "study.json").at("stairs");
    std::map<int, std::vector<Response>> answers;
    std::map<int, std::set<int>> stimuli;
    for (const Trial& trial : of_block(protocol, 2, "stairs")) {
      stimuli[trial.track].insert(trial.stimulus);
      const TrialOutcome outcome = answer_to(trial);
      if (outcome.answered) answers[trial.track].push_back({*trial.level, outcome.success});
    }
    ASSERT_EQ(answers.size(), 12U) << mixing;
    for (const auto& [track, own] : answers) {
      EXPECT_EQ(stimuli[track].size(), 1U);
      Procedure again = procedures.begin(2, track);
      for (const Response& answer : own) {
        ASSERT_EQ(*again.next_level(), answer.level) << mixing << ", track " << track;
        again.record(answer);
      }
    }
  }
}

TEST(Factors, SharedTracksGoOverAllCells) {
  json study = crossed_study("stairs");
  study["blocks"][1]["shared"] = true;
  ASSERT_EQ(study["blocks"][1]["name"], "stairs");
  const Protocol protocol = parsed(study);
  const BlockProcedures procedures =
      procedures_of_blocks(protocol.source_text, "study.json").at("stairs");
  std::map<int, std::vector<Response>> answers;
  std::map<int, std::vector<int>> stimuli;
  for (const Trial& trial : of_block(protocol, 2, "stairs")) {
    const TrialOutcome outcome = answer_to(trial);
    if (!outcome.answered || trial.catch_trial) continue;
    stimuli[trial.track].push_back(trial.stimulus);
    answers[trial.track].push_back({*trial.level, outcome.success});
  }
  ASSERT_EQ(answers.size(), 2U);
  std::set<std::vector<int>> orders;
  const std::vector<std::vector<int>> fixed = shared_track_order(protocol, 2, 1);
  ASSERT_EQ(fixed.size(), 2U);
  for (const auto& [track, own] : answers) {
    Procedure again = procedures.begin(2, track);
    for (const Response& answer : own) {
      ASSERT_EQ(*again.next_level(), answer.level) << "track " << track;
      again.record(answer);
    }
    const std::vector<int>& shown = stimuli[track];
    ASSERT_GE(shown.size(), 12U);
    const std::vector<int>& order = fixed[static_cast<std::size_t>(track) - 1];
    ASSERT_GE(order.size(), 30U) << "for every trial that the track may have";
    EXPECT_TRUE(std::equal(shown.begin(), shown.end(), order.begin()));
    for (std::size_t round = 0; round + 6 <= shown.size(); round += 6) {
      const std::vector<int> cells(shown.begin() + round, shown.begin() + round + 6);
      EXPECT_EQ(std::set<int>(cells.begin(), cells.end()).size(), 6U) << "each cell once";
      orders.insert(cells);
    }
  }
  EXPECT_GT(orders.size(), 2U);
  study["blocks"][1].erase("shared");
  const Protocol apart = parsed(study);
  for (const char* const other : {"constant"}) {
    const auto lines = [&](const Protocol& of) {
      std::vector<std::pair<int, std::optional<double>>> out;
      for (const Trial& trial : of_block(of, 2, other))
        out.emplace_back(trial.stimulus, trial.level);
      return out;
    };
    EXPECT_EQ(lines(protocol), lines(apart)) << "no other block changes";
  }
  study["blocks"][1]["shared"] = true;
  study["blocks"][1]["mixing"] = "blocked";
  EXPECT_EQ(faults_of(study), std::vector<std::string>{"/blocks/1/shared"});
  json constant = crossed_study("constant");
  constant["blocks"][0]["shared"] = true;
  EXPECT_EQ(faults_of(constant), std::vector<std::string>{"/blocks/0/shared"});
  json plain = task_study();
  plain["blocks"][0]["shared"] = false;
  EXPECT_EQ(faults_of(plain), std::vector<std::string>{"/blocks/0/shared"});
}

TEST(Factors, ABlockMayTakeSomeLevels) {
  json study = crossed_study("constant");
  study["blocks"][0]["factors"] = {{"size", {"l", "s"}}};
  study["factors"].erase(0);
  const Protocol protocol = parsed(study);
  std::vector<std::string> names;
  for (const int stimulus : protocol.blocks[0].stimuli)
    names.push_back(protocol.stimuli[static_cast<std::size_t>(stimulus)].name);
  EXPECT_EQ(names, (std::vector<std::string>{"soft[size=l]", "soft[size=s]"}));
}

TEST(Factors, CellsApartSetTheirBlock) {
  json study = crossed_study("constant", "blocked");
  study["factors"][0]["levels"][1]["set"]["/block/time_out_s"] = 7;
  const Protocol protocol = parsed(study);
  for (const TaskBlock& block : protocol.blocks) {
    if (block.name != "constant") continue;
    const std::string& name = protocol.stimuli[static_cast<std::size_t>(block.stimuli[0])].name;
    EXPECT_EQ(block.time_out, cell_name(name).level("surface") == "rough" ? 7 : 60);
  }
}

TEST(Factors, AnswersAreOfPlainStimuli) {
  json study = crossed_study("none");
  study["blocks"].push_back(json::parse(R"({"name": "which", "task": "identify",
    "stimuli": ["soft", "lump"], "repetitions": 2, "factors": ["surface"]})"));
  study["factors"].erase(1);
  const Protocol protocol = parsed(study);
  const TaskBlock& block = protocol.blocks.back();
  ASSERT_EQ(block.answers.size(), 2U);
  EXPECT_EQ(block.answers[0].name, "soft");
  EXPECT_EQ(block.stimuli.size(), 4U);
}

TEST(Factors, TestsNameEffectsInOrder) {
  json study = crossed_study("constant");
  study["tests"] = {"surface", "size", "renderer:surface:size"};
  EXPECT_EQ(parsed(study).tests.size(), 3U);
  study["tests"] = {"size:surface", "group", "surface", "surface", "surface:surface", "lag", 3, ""};
  EXPECT_EQ(faults_of(study),
            (std::vector<std::string>{"/tests/0", "/tests/1", "/tests/3", "/tests/4", "/tests/5",
                                      "/tests/6", "/tests/7"}));
  json plain = task_study();
  plain["tests"] = {"renderer"};
  EXPECT_EQ(faults_of(plain), std::vector<std::string>{"/tests"});
  plain["groups"] = {{"names", {"a", "b"}}};
  plain["tests"] = {"group", "group:renderer"};
  EXPECT_EQ(parsed(plain).tests.size(), 2U);
}

TEST(Factors, FaultsNameTheirPlace) {
  const auto with = [](const std::function<void(json&)>& change, const char* mixing = "mixed") {
    json study = crossed_study("constant", mixing);
    change(study);
    return faults_of(study);
  };
  using Places = std::vector<std::string>;
  const std::string first = "/factors/0/levels/0/set/";
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/stimuli/*/radius_m"] = 1; }),
            (Places{first.substr(0, 9) + "1/levels/0/set/~1stimuli~1*~1radius_m",
                    "/factors/1/levels/2/set/~1stimuli~1soft~1radius_m"}))
      << "two factors set one thing";
  EXPECT_EQ(with([](json& s) {
              s["factors"][0]["levels"][0]["set"]["/stimuli/*/stiffness_n_per_m"] = 100;
            }),
            Places{first + "~1stimuli~1*~1stiffness_n_per_m"})
      << "the level";
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/block/time_out_s"] = 7; }),
            Places{first + "~1block~1time_out_s"})
      << "mixed";
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/block/stimuli"] = {"lump"}; },
                 "blocked"),
            Places{first + "~1block~1stimuli"});
  EXPECT_EQ(
      with([](json& s) { s["factors"][0]["levels"][0]["set"]["/stimuli/no/friction_static"] = 1; }),
      Places{first + "~1stimuli~1no~1friction_static"});
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/stimuli/*/layers/0/x"] = 1; }),
            Places{first + "~1stimuli~1*~1layers~10~1x"})
      << "a place that the stimulus lacks";
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/stimuli/*/height_m"] = 1; }),
            Places{first + "~1stimuli~1*~1height_m"})
      << "a key that a sphere does not have";
  EXPECT_EQ(with([](json& s) {
              s["factors"][0]["levels"][0]["set"]["/stimuli/*/friction_dynamic"] = "a";
            }),
            Places{first + "~1stimuli~1*~1friction_dynamic"});
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/servo/rate_hz"] = 500; }),
            Places{first + "~1servo~1rate_hz"});
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][0]["set"]["/stimuli/*/name"] = "x"; }),
            Places{first + "~1stimuli~1*~1name"});
  for (const char* const key : {"asks", "intervals", "answer", "order", "catch_trials"}) {
    EXPECT_EQ(
        with(
            [&](json& s) { s["factors"][0]["levels"][0]["set"][std::string("/block/") + key] = 2; },
            "blocked"),
        Places{first + "~1block~1" + key})
        << "answers of the cells would not compare";
  }
  EXPECT_EQ(with([](json& s) { s["factors"][0]["levels"][1]["set"] = json::object(); }),
            Places{"/factors/0/levels/1/set"})
      << "levels alike";
  EXPECT_EQ(with([](json& s) { s["blocks"][0]["factors"] = {"surface"}; }), Places{"/factors/1"})
      << "a factor that nobody crosses";
  for (const char* const name : {"renderer", "Group", "elapsed", "tip_x"})
    EXPECT_EQ(with([&](json& s) { s["factors"][0]["name"] = name; }).front(), "/factors/0/name");
  EXPECT_EQ(with([](json& s) { s["factors"][1]["name"] = "surface"; }).front(), "/factors/1/name");
  EXPECT_EQ(with([](json& s) { s["factors"][1]["levels"][1]["name"] = "s"; }).front(),
            "/factors/1/levels/1/name");
  EXPECT_EQ(with([](json& s) {
              s["blocks"][0]["factors"] = {"surface", "colour"};
            }),
            Places{"/blocks/0/factors/1"});
  EXPECT_EQ(with([](json& s) {
              s["blocks"][0]["factors"] = {{"surface", {"smooth", "wet"}}};
            }),
            Places{"/blocks/0/factors/surface/1"});
  EXPECT_EQ(with([](json& s) { s["blocks"][1]["mixing"] = "blocked"; }),
            Places{"/blocks/1/mixing"});
  EXPECT_EQ(with([](json& s) {
              for (int i = 0; i < 30; ++i)
                s["factors"][0]["levels"].push_back(
                    {{"name", "l" + std::to_string(i)}, {"set", json::object()}});
            }),
            Places{"/blocks/0/factors"})
      << "96 cells";
  EXPECT_EQ(with([](json& s) { s["stimuli"][0]["name"] = "soft[surface=rough]"; }).front(),
            "/stimuli/0/name");
}

}  // namespace factors
}  // namespace
}  // namespace palpate::protocols
