#include "protocols/parse_grid.h"

#include <algorithm>
#include <string>

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr NumberRange kWeight{0, 1e9, "", true};

std::vector<double> read_list(const json& list, const std::string& pointer,
                              const GridLimits& limits, FaultList& faults) {
  std::vector<double> values;
  if (list.empty() || list.size() > limits.most) {
    faults.add(pointer, "expected 1 to " + std::to_string(limits.most) + " numbers, found " +
                            std::to_string(list.size()));
    return values;
  }
  const std::size_t before = faults.count();
  for (std::size_t i = 0; i < list.size(); ++i) {
    double value = 0;
    read_number(list[i], child_pointer(pointer, i), value, limits.range, faults);
    if (faults.count() == before && !limits.may_repeat &&
        std::find(values.begin(), values.end(), value) != values.end())
      faults.add(child_pointer(pointer, i), "expected each value once" + found_text(list[i]));
    values.push_back(value);
  }
  return faults.count() == before ? values : std::vector<double>();
}

std::vector<double> read_range(ObjectReader& reader, const GridLimits& limits) {
  FaultList& faults = reader.faults();
  const std::size_t before = faults.count();
  double from = 0, to = 0;
  int count = 0;
  LevelScale spacing = LevelScale::linear;
  reader.choice("spacing", spacing, {{"linear", LevelScale::linear}, {"log", LevelScale::log10}});
  reader.number("from", from, limits.range, Presence::required);
  reader.number("to", to, limits.range, Presence::required);
  reader.integer("count", count, {2, static_cast<double>(limits.most)}, Presence::required);
  if (faults.count() != before) return {};
  if (!(from < to)) {
    faults.add(reader.pointer("to"), "expected more than from");
    return {};
  }
  if (spacing == LevelScale::log10 && !(from > 0)) {
    faults.add(reader.pointer("from"), "expected more than 0 with spacing 'log'");
    return {};
  }
  const double low = scale_position(spacing, from), high = scale_position(spacing, to);
  std::vector<double> values{from};
  for (int i = 1; i < count - 1; ++i)
    values.push_back(level_at(spacing, low + (high - low) * i / (count - 1)));
  values.push_back(to);
  return values;
}

/// {"values": [...], "weights": [...]}
ParameterGrid read_weighted(ObjectReader& reader, const GridLimits& limits) {
  ParameterGrid grid;
  const GridLimits weights{kWeight, limits.most, Presence::optional, true};
  grid.values = read_grid_values(reader, "values", limits);
  grid.weights = read_grid_values(reader, "weights", weights);
  if (!grid.values.empty() && !grid.weights.empty() && grid.values.size() != grid.weights.size()) {
    reader.faults().add(reader.pointer("weights"), "expected as many numbers as values, " +
                                                       std::to_string(grid.values.size()) +
                                                       ", found " +
                                                       std::to_string(grid.weights.size()));
  }
  return grid;
}

}  // namespace

std::vector<double> read_grid_values(ObjectReader& reader, const char* key,
                                     const GridLimits& limits) {
  const json* const value = reader.member(key, limits.presence);
  if (value == nullptr) return {};
  const std::string pointer = reader.pointer(key);
  if (value->is_array()) return read_list(*value, pointer, limits, reader.faults());
  if (value->is_object()) {
    ObjectReader inner(*value, pointer, reader.faults());
    std::vector<double> values = read_range(inner, limits);
    inner.refuse_unknown_keys();
    return values;
  }
  double number = 0;
  if (!read_number(*value, pointer, number, limits.range, reader.faults())) return {};
  return {number};
}

ParameterGrid read_grid(ObjectReader& reader, const char* key, const GridLimits& limits) {
  ParameterGrid grid;
  const json* const value = reader.member(key, limits.presence);
  if (value == nullptr || !value->is_object() || !value->contains("values")) {
    if (value != nullptr) grid.values = read_grid_values(reader, key, limits);
    return grid;
  }
  reader.section(key, [&](ObjectReader& inner) { grid = read_weighted(inner, limits); });
  return grid;
}

}  // namespace palpate::protocols
