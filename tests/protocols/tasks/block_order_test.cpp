// Blocks whose trials are fixed in advance: their kinds and numbers, and the limits on their order.

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {
namespace block_order {

using nlohmann::json;

json study_of(const json& block) {
  json study = task_study();
  study["stimuli"] = json::parse(
      R"([{"name": "a", "shape": "cube", "edge_m": 0.03}, {"name": "b", "shape": "cube", "edge_m": 0.04},
          {"name": "c", "shape": "cube", "edge_m": 0.05}])");
  study["blocks"] = json::array({block});
  return study;
}

json identify(const json& renderers) {
  return {{"name", "i"},
          {"task", "identify"},
          {"stimuli", {"a", "b", "c"}},
          {"renderers", renderers},
          {"repetitions", 6},
          {"keys", {{"1", "a"}, {"2", "b"}, {"3", "c"}}}};
}

json levels(const char* task, const json& renderers) {
  json block = {
      {"name", "l"},
      {"task", task},
      {"stimuli", {"a", "b"}},
      {"renderers", renderers},
      {"level", {{"path", "/stiffness_n_per_m"}}},
      {"procedure", {{"kind", "constant"}, {"levels", {200, 300, 500}}, {"repetitions", 4}}}};
  if (block["task"] == "compare") block["standard"] = "c";
  return block;
}

using Kind = std::tuple<int, RendererKind, std::optional<double>>;  ///< stimulus, renderer, level

Kind kind_of(const Trial& trial) { return {trial.stimulus, trial.renderer, trial.level}; }

/// \param of_each  trials of each kind
void expect_order(const json& block, std::size_t kinds, int of_each, std::size_t longest,
                  std::size_t nearest) {
  const Protocol protocol = parsed(study_of(block));
  std::set<std::vector<Kind>> orders;
  for (int participant = 1; participant <= 12; ++participant) {
    std::map<Kind, int> counts;
    std::map<std::pair<int, RendererKind>, int> tracks;
    std::vector<Kind> order;
    for (const Trial& trial : worked_off(SessionPlan(protocol, participant, 1))) {
      const Kind kind = kind_of(trial);
      ++counts[kind];
      order.push_back(kind);
      const auto [known, added] = tracks.insert({{trial.stimulus, trial.renderer}, trial.track});
      EXPECT_EQ(known->second, trial.track) << added;
      for (const Interval& interval : trial.intervals) {
        EXPECT_EQ(interval.renderer, trial.renderer);
        EXPECT_EQ(interval.stimulus, interval.standard ? 2 : trial.stimulus);
      }
      // At most `longest` of one kind in a row, and equal kinds at least `nearest` trials apart.
      std::size_t run = 1;
      while (run < order.size() && order[order.size() - 1 - run] == kind) ++run;
      EXPECT_LE(run, longest) << block.dump() << " " << order.size();
      for (std::size_t back = 1; back < nearest && back < order.size(); ++back)
        EXPECT_NE(order[order.size() - 1 - back], kind) << block.dump() << " " << order.size();
    }
    EXPECT_EQ(counts.size(), kinds) << block.dump();
    for (const auto& [kind, count] : counts) EXPECT_EQ(count, of_each) << block.dump();
    std::set<int> numbers;
    for (const auto& [pair, track] : tracks) numbers.insert(track);
    EXPECT_EQ(numbers.size(), tracks.size()) << block.dump();
    EXPECT_EQ(*numbers.begin(), 1);
    EXPECT_EQ(*numbers.rbegin(), static_cast<int>(tracks.size()));
    orders.insert(order);
  }
  EXPECT_EQ(orders.size(), 12U) << "by chance: no two participants alike";
}

TEST(BlockOrder, KeepsLimitsWithOneAndTwoRenderers) {
  constexpr std::size_t kAny = 1000;
  for (const json& renderers : {json{"ray"}, json{"point", "ray"}}) {
    const std::size_t n = renderers.size();
    for (json block : {identify(renderers), levels("compare", renderers),
                       levels("detect", renderers), levels("rate", renderers)}) {
      const bool identifies = block["task"] == "identify";
      const std::size_t kinds = (identifies ? 3 : 6) * n;
      const int of_each = identifies ? 6 : 4;
      expect_order(block, kinds, of_each, kAny, 1);
      for (const std::size_t longest : {1, 2}) {
        block["order"] = {{"max_run", longest}};
        expect_order(block, kinds, of_each, longest, 1);
      }
      for (const std::size_t nearest : {2, 3}) {
        block["order"] = {{"min_distance", nearest}};
        // Three kinds three apart have one order for each beginning.
        if (kinds > nearest) expect_order(block, kinds, of_each, kAny, nearest);
      }
    }
  }
}

}  // namespace block_order
}  // namespace
}  // namespace palpate::protocols
