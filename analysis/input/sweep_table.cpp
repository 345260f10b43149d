#include "analysis/input/sweep_table.h"

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/store/sweep_file.h"
#include "data/stored_protocol.h"
#include "protocols/parse.h"

namespace palpate::analysis {

namespace {

double coded(const data::SweepValue& value, std::vector<std::string>& words) {
  if (const auto* const number = std::get_if<double>(&value)) return *number;
  const std::string& word = std::get<std::string>(value);
  const auto found = std::find(words.begin(), words.end(), word);
  if (found != words.end()) return static_cast<double>(found - words.begin());
  words.push_back(word);
  return static_cast<double>(words.size() - 1);
}

/// Words in the order of the space, so that their codes do not depend on the points.
std::vector<std::vector<std::string>> words_of(const data::SweepPlan& plan) {
  std::vector<std::vector<std::string>> out(plan.parameters.size());
  const auto space = json_or_discarded(plan.space);
  if (!space.is_object() || !space.contains("parameters") || !space["parameters"].is_array())
    return out;
  std::size_t p = 0;
  for (const auto& parameter : space["parameters"]) {
    if (p == out.size() || !parameter.is_object()) break;
    if (parameter.contains("values") && parameter["values"].is_array()) {
      for (const auto& value : parameter["values"]) {
        if (value.is_string()) out[p].push_back(value.get<std::string>());
      }
    }
    ++p;
  }
  return out;
}

}  // namespace

std::optional<std::size_t> SweepTable::column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.begin());
}

SweepTable read_sweep_table(const std::string& path) {
  data::SweepFile file = data::SweepFile::open(path);
  const data::SweepPlan& plan = file.plan();
  SweepTable table;
  table.source = path;
  table.design = plan.design;
  table.planned = plan.points;
  table.seed = plan.seed;
  table.participants = plan.participants;
  table.program_version = plan.program_version;
  const data::StoredProtocol protocol = data::read_stored_protocol(plan.protocol);
  table.protocol_name = protocol.name;
  table.repetitions = protocol.repetitions;
  table.parameters = plan.parameters;
  table.shapes = plan.shapes;
  table.renderers = plan.renderers;
  table.columns = plan.parameters;
  for (const std::string& column : data::figure_columns(plan)) table.columns.push_back(column);
  table.estimates = data::estimate_columns(plan);
  table.values.resize(table.columns.size());
  table.words = words_of(plan);
  std::map<std::string, std::size_t> reasons;
  file.for_each([&](const data::SweepRow& row) {
    table.points.push_back(row.point);
    table.failed.push_back(!row.reason.empty());
    if (!row.reason.empty()) ++reasons[row.reason];
    for (std::size_t p = 0; p < row.values.size(); ++p)
      table.values[p].push_back(coded(row.values[p], table.words[p]));
    for (std::size_t f = 0; f < row.figures.size(); ++f) {
      table.values[row.values.size() + f].push_back(
          row.figures[f].value_or(std::numeric_limits<double>::quiet_NaN()));
    }
  });
  if (table.points.empty()) {
    throw protocols::InputError(
        {{path, "(sweep)", "at least one point on record; this file holds none yet", 0}});
  }
  table.reasons.assign(reasons.begin(), reasons.end());
  std::stable_sort(table.reasons.begin(), table.reasons.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return table;
}

}  // namespace palpate::analysis
