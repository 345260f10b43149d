#include "data/sweep_record.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <nlohmann/json.hpp>

#include "data/base/cell_name.h"
#include "data/base/json_text.h"
#include "data/base/words.h"
#include "data/stored_protocol.h"

namespace palpate::data {
namespace {

constexpr std::size_t kMaxNamed = 5;  // most places named in a difference
constexpr std::size_t kMaxValue = 43;

std::string shown(const nlohmann::json& value) { return json_excerpt(value, kMaxValue); }

/// Describes the steps that turn one document into another (RFC 6902): "/seed 1 and 2".
class DifferenceTexts {
 public:
  explicit DifferenceTexts(const nlohmann::json& one) : one_(one) {}

  std::string of(const nlohmann::json& step) {
    const std::string named = step.at("path").get<std::string>();
    const nlohmann::json::json_pointer place(named);
    const bool adds = step.at("op") == "add";
    return (adds ? place_of_added(place) : named) + " " +
           (adds ? "(nothing)" : shown(one_.at(place))) + " and " +
           (step.at("op") == "remove" ? "(nothing)" : shown(step.at("value")));
  }

 private:
  /// "-" denotes the place after a list's last element.
  std::string place_of_added(const nlohmann::json::json_pointer& place) {
    const nlohmann::json::json_pointer list = place.parent_pointer();
    if (place.back() != "-" || !one_.at(list).is_array()) return place.to_string();
    const std::size_t next = one_.at(list).size() + appended_[list.to_string()]++;
    return list.to_string() + "/" + std::to_string(next);
  }

  const nlohmann::json& one_;
  std::map<std::string, std::size_t> appended_;  // elements of a list, by its pointer
};

/// "/seed 1 and 2; /stimuli/0/radius_m 0.03 and 0.02"
std::string json_differences(const std::string& a, const std::string& b) {
  const nlohmann::json one = json_or_discarded(a), two = json_or_discarded(b);
  if (one.is_discarded() || two.is_discarded()) return "texts that cannot be compared";
  std::string out;
  std::size_t named = 0;
  const nlohmann::json patch = nlohmann::json::diff(one, two);
  DifferenceTexts texts(one);
  for (const nlohmann::json& step : patch) {
    if (named++ == kMaxNamed) {
      return out + "; and " + std::to_string(patch.size() - kMaxNamed) + " more";
    }
    out += (out.empty() ? "" : "; ") + texts.of(step);
  }
  return out.empty() ? "their layout alone" : out;
}

std::vector<std::string> measures_of(const std::string& task) {
  if (task == "compare") return {"threshold", "jnd"};
  if (task == "detect") return {"threshold", "d_prime"};
  if (task == "rate") return {"exponent"};
  if (task == "adjust") return {"pse", "jnd"};
  if (task == "reach") return {"deviation", "adaptation"};
  return {"accuracy", "time"};
}

/// Whether the space has settings of a group of participants.
bool varies_a_group(const SweepPlan& plan) {
  const nlohmann::json space = json_or_discarded(plan.space);
  if (!space.is_object() || !space.contains("parameters")) return false;
  return std::ranges::any_of(space["parameters"], [](const nlohmann::json& one) {
    return one.is_object() && one.contains("of") && one["of"].is_string() &&
           one["of"].get_ref<const std::string&>().starts_with("group:");
  });
}

std::vector<std::string> block_columns(const StoredBlock& block, const CellName& stimulus,
                                       const std::string& renderer, const std::string& group,
                                       const std::vector<std::string>& measures) {
  std::string place = "_" + block.name;
  if (!stimulus.base.empty()) place += "_" + stimulus.base;
  for (const auto& [factor, level] : stimulus.levels) place += "_" + level;
  place += "_" + renderer;
  if (!group.empty()) place += "_" + group;
  std::vector<std::string> out;
  for (const std::string& measure : measures) {
    out.push_back(measure + place);
    out.push_back(measure + "_se" + place);
  }
  return out;
}

}  // namespace

std::vector<std::string> differences(const SweepPlan& a, const SweepPlan& b) {
  std::vector<std::string> out;
  const auto texts = [&](const char* what, const std::string& one, const std::string& two) {
    if (one != two) out.push_back(std::string(what) + ": " + json_differences(one, two));
  };
  const auto values = [&](const char* what, const auto& one, const auto& two) {
    if (one != two)
      out.push_back(std::string(what) + ": " + shown(nlohmann::json(one)) + " and " +
                    shown(nlohmann::json(two)));
  };
  texts("protocol", a.protocol, b.protocol);
  if (a.files_sha256 != b.files_sha256)
    out.emplace_back("contents of the files that the protocol names");
  texts("settings of the participant", a.settings, b.settings);
  texts("space", a.space, b.space);
  values("design", a.design, b.design);
  values("points", a.points, b.points);
  values("seed", a.seed, b.seed);
  values("participants", a.participants, b.participants);
  values("program version", a.program_version, b.program_version);
  values("parameters", a.parameters, b.parameters);
  values("shapes", a.shapes, b.shapes);
  values("renderers", a.renderers, b.renderers);
  values("columns for the cells of factors", a.has_cells, b.has_cells);
  return out;
}

std::vector<TaskCellColumns> task_columns(const SweepPlan& plan) {
  std::vector<TaskCellColumns> cells;
  const StoredProtocol protocol = read_stored_protocol(plan.protocol);
  std::vector<std::string> groups{""};
  if (varies_a_group(plan))
    groups.insert(groups.end(), protocol.groups.names.begin(), protocol.groups.names.end());
  for (const std::string& group : groups) {
    for (const StoredBlock& block : protocol.blocks) {
      if (block.practice) continue;
      for (const std::string& renderer : block.renderers) {
        const auto add = [&](const CellName& stimulus, const std::vector<std::string>& measures) {
          cells.push_back({block.task, block.name, stimulus.text(), renderer, group, measures,
                           block_columns(block, stimulus, renderer, group, measures)});
        };
        for (const std::string& stimulus : block.stimuli) {
          const bool apart = plan.has_cells && !block.cells.empty();
          if (!apart) add({stimulus}, measures_of(block.task));
          if (apart)
            for (const auto& levels : block.cells) add({stimulus, levels}, measures_of(block.task));
        }
        if (block.task == "identify") add({}, {"bits"});
      }
    }
  }
  return cells;
}

std::vector<std::string> figure_columns(const SweepPlan& plan) {
  std::vector<std::string> out;
  for (const TaskCellColumns& cell : task_columns(plan))
    out.insert(out.end(), cell.columns.begin(), cell.columns.end());
  for (const char* what : {"gain_", "gain_se_"}) {
    for (const std::string& shape : plan.shapes) out.push_back(what + shape);
  }
  for (const char* what : {"time_", "accuracy_", "time_outs_", "contact_share_"}) {
    for (const std::string& renderer : plan.renderers) {
      for (const std::string& shape : plan.shapes) out.push_back(what + (renderer + "_" + shape));
    }
  }
  return out;
}

std::vector<EstimateColumns> estimate_columns(const SweepPlan& plan) {
  std::vector<EstimateColumns> out;
  for (const TaskCellColumns& cell : task_columns(plan)) {
    for (std::size_t c = 0; c < cell.columns.size(); c += 2)
      out.push_back({cell.columns[c], cell.columns[c + 1]});
  }
  for (const std::string& shape : plan.shapes) out.push_back({"gain_" + shape, "gain_se_" + shape});
  return out;
}

std::vector<std::string> sweep_columns(const SweepPlan& plan) {
  std::vector<std::string> out{"point", "status", "reason"};
  out.insert(out.end(), plan.parameters.begin(), plan.parameters.end());
  const std::vector<std::string> figures = figure_columns(plan);
  out.insert(out.end(), figures.begin(), figures.end());
  return out;
}

std::optional<std::pair<std::string, std::string>> columns_alike(const SweepPlan& plan) {
  std::map<std::string, std::string> seen{{"seed", "seed"}, {"order_seed", "order_seed"}};
  for (const std::string& column : sweep_columns(plan)) {
    const auto [found, added] = seen.emplace(lower_case(column), column);
    if (!added) return std::pair(found->second, column);
  }
  for (const std::string& parameter : plan.parameters) {
    for (const std::string& shape : plan.shapes) {
      if (lower_case(parameter) == lower_case(shape)) return std::pair(parameter, shape);
    }
  }
  return std::nullopt;
}

}  // namespace palpate::data
