#include "protocols/factors.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/base/cell_name.h"
#include "data/base/column_names.h"
#include "data/base/json_text.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMostFactors = 6;
constexpr std::size_t kMostLevels = 64;
constexpr std::size_t kMostCells = 64;
constexpr std::size_t kMostSets = 100;
constexpr const char* kOfStimuli = "/stimuli/";
constexpr const char* kOfBlock = "/block/";

/// A part of what a level sets: of the stimuli, or of the block.
struct Target {
  std::string stimulus;  ///< "*": all of the block; "": the block itself
  std::string rest;      ///< pointer into it
};

/// nullopt: it points to neither.
std::optional<Target> target_of(const std::string& pointer) {
  if (pointer.starts_with(kOfBlock))
    return Target{"", pointer.substr(std::string_view(kOfBlock).size() - 1)};
  if (!pointer.starts_with(kOfStimuli)) return std::nullopt;
  const std::string after = pointer.substr(std::string_view(kOfStimuli).size());
  const std::size_t slash = after.find('/');
  if (slash == std::string::npos || slash == 0 || slash + 1 == after.size()) return std::nullopt;
  return Target{after.substr(0, slash), after.substr(slash)};
}

bool one_holds_the_other(const std::string& a, const std::string& b) {
  const std::string &shorter = a.size() < b.size() ? a : b, &longer = a.size() < b.size() ? b : a;
  return longer.starts_with(shorter) &&
         (longer.size() == shorter.size() || longer[shorter.size()] == '/');
}

bool overlap(const Target& a, const Target& b) {
  const bool same = a.stimulus == b.stimulus || (!a.stimulus.empty() && !b.stimulus.empty() &&
                                                 (a.stimulus == "*" || b.stimulus == "*"));
  return same && one_holds_the_other(a.rest, b.rest);
}

void read_level_sets(ObjectReader& reader, FactorLevel& level) {
  const json* const sets = reader.member("set", Presence::required);
  if (sets == nullptr) return;
  if (!sets->is_object() || sets->size() > kMostSets) {
    reader.faults().add(reader.pointer("set"),
                        "expected an object of a value for each JSON pointer, at most " +
                            std::to_string(kMostSets) + found_text(*sets));
    return;
  }
  for (const auto& [pointer, value] : sets->items()) {
    const std::string place = child_pointer(reader.pointer("set"), pointer);
    if (!target_of(pointer)) {
      const bool servo = pointer.starts_with("/servo");
      reader.faults().add(
          place, servo
                     ? "expected a pointer into stimuli or block: the servo's settings hold for a "
                       "whole session; give them to groups or sessions of their own"
                     : "expected a pointer such as '/stimuli/*/friction_static', "
                       "'/stimuli/NAME/size_m' or '/block/time_out_s'");
      continue;
    }
    if (target_of(pointer)->rest == "/name")
      reader.faults().add(place, "expected another key: results know stimuli and blocks by name");
    level.sets.emplace_back(pointer, value.dump());
  }
}

void read_factor_name(ObjectReader& item, std::set<std::string>& names, std::string& name) {
  item.name("name", name);
  if (name.empty()) return;
  if (is_column_name(name))
    item.faults().add(item.pointer("name"),
                      "expected another name: tables have a column '" + name + "' already");
  if (!names.insert(name).second)
    item.faults().add(item.pointer("name"), "expected a unique name, found '" + name + "' again");
}

void read_factor(ObjectReader& item, std::set<std::string>& factor_names, Factor& factor) {
  read_factor_name(item, factor_names, factor.name);
  const json* const levels = item.array("levels", 2, kMostLevels, Presence::required);
  if (levels == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < levels->size(); ++i) {
    ObjectReader one((*levels)[i], child_pointer(item.pointer("levels"), i), item.faults());
    FactorLevel& level = factor.levels.emplace_back();
    one.name("name", level.name);
    if (!level.name.empty() && !names.insert(level.name).second)
      one.faults().add(one.pointer("name"),
                       "expected a unique name, found '" + level.name + "' again");
    read_level_sets(one, level);
    one.refuse_unknown_keys();
  }
}

std::optional<std::size_t> index_of_factor(const Protocol& protocol, const std::string& name) {
  const auto found = std::ranges::find(protocol.factors, name, &Factor::name);
  if (found == protocol.factors.end()) return std::nullopt;
  return static_cast<std::size_t>(found - protocol.factors.begin());
}

std::string factor_names(const Protocol& protocol) {
  std::string out;
  for (const Factor& factor : protocol.factors)
    (out += out.empty() ? "'" : ", '") += factor.name + "'";
  return out.empty() ? "none: the protocol has no 'factors'" : out;
}

/// The levels of one factor that a block names; all: no list.
void read_chosen(const json* list, const std::string& pointer, const Factor& factor,
                 CrossedFactor& crossed, FaultList& faults) {
  if (list == nullptr) {
    for (std::size_t i = 0; i < factor.levels.size(); ++i) crossed.levels.push_back(i);
    return;
  }
  if (!list->is_array() || list->empty()) {
    faults.add(pointer, "expected a list of levels of '" + factor.name + "'" + found_text(*list));
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& one = (*list)[i];
    const auto at = std::ranges::find(factor.levels, one.is_string() ? one.get<std::string>() : "",
                                      &FactorLevel::name);
    const auto index = static_cast<std::size_t>(at - factor.levels.begin());
    if (at == factor.levels.end()) {
      faults.add(child_pointer(pointer, i),
                 "expected a level of '" + factor.name + "'" + found_text(one));
    } else if (std::ranges::find(crossed.levels, index) != crossed.levels.end()) {
      faults.add(child_pointer(pointer, i),
                 "expected each level once" + found_text(one) + " again");
    } else {
      crossed.levels.push_back(index);
    }
  }
}

void read_crossed(ObjectReader& reader, const json& value, const Protocol& protocol,
                  TaskBlock& block) {
  const auto add = [&](const std::string& name, const std::string& place, const json* levels) {
    const std::optional<std::size_t> factor = index_of_factor(protocol, name);
    if (!factor) {
      reader.faults().add(
          place, "expected a factor, one of " + factor_names(protocol) + ", found '" + name + "'");
      return;
    }
    if (std::ranges::find(block.factors, *factor, &CrossedFactor::factor) != block.factors.end()) {
      reader.faults().add(place, "expected each factor once, found '" + name + "' again");
      return;
    }
    CrossedFactor& crossed = block.factors.emplace_back(CrossedFactor{*factor, {}});
    read_chosen(levels, place, protocol.factors[*factor], crossed, reader.faults());
  };
  const std::string pointer = reader.pointer("factors");
  if (value.is_object()) {
    for (const auto& [name, levels] : value.items())
      add(name, child_pointer(pointer, name), &levels);
  } else {
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (value[i].is_string())
        add(value[i].get<std::string>(), child_pointer(pointer, i), nullptr);
      else
        reader.faults().add(child_pointer(pointer, i),
                            "expected the name of a factor" + found_text(value[i]));
    }
  }
  // Cells are in the order of the protocol's factors, however the block lists them.
  std::ranges::sort(block.factors, {}, &CrossedFactor::factor);
}

/// The level of each of the block's factors in a cell: the last factor varies fastest.
std::vector<std::size_t> levels_of_cell(const TaskBlock& block, std::size_t cell) {
  std::vector<std::size_t> out(block.factors.size());
  for (std::size_t f = block.factors.size(); f-- > 0;) {
    const std::vector<std::size_t>& levels = block.factors[f].levels;
    out[f] = levels[cell % levels.size()];
    cell /= levels.size();
  }
  return out;
}

std::string pointer_of_set(std::size_t factor, std::size_t level, const std::string& set) {
  return child_pointer(
      "/factors/" + std::to_string(factor) + "/levels/" + std::to_string(level) + "/set", set);
}

/// Makes the stimuli of the cells, each once.
class Cells {
 public:
  Cells(const json& root, const MeshFiles& files, Protocol& protocol, FaultList& faults)
      : root_(root), files_(files), protocol_(protocol), faults_(faults) {}

  void add_all();

 private:
  CellName name_of(const TaskBlock& block, const std::vector<std::size_t>& levels,
                   int stimulus) const;
  int in_cell(const TaskBlock& block, const std::vector<std::size_t>& levels, int stimulus);
  void put_cell(TaskBlock& block, const std::vector<std::size_t>& levels, const TaskBlock& plain);
  /// The block's own keys as a cell sets them.
  TaskBlock block_in_cell(const TaskBlock& plain, std::size_t cell);
  void check_sets(const TaskBlock& block);
  void check_uses();
  bool set(json& value, const std::string& rest, const std::string& text, const std::string& place,
           const std::string& of);

  const json& root_;
  const MeshFiles& files_;
  Protocol& protocol_;
  FaultList& faults_;
  std::map<std::string, int> known_;  // stimuli of cells, by name
  std::set<std::string> told_;        // faults, by place and text
};

bool selects(const Target& target, const Protocol& protocol, int stimulus) {
  return target.stimulus == "*" ||
         target.stimulus == protocol.stimuli[static_cast<std::size_t>(stimulus)].name;
}

CellName Cells::name_of(const TaskBlock& block, const std::vector<std::size_t>& levels,
                        int stimulus) const {
  CellName name{protocol_.stimuli[static_cast<std::size_t>(stimulus)].name};
  for (std::size_t f = 0; f < levels.size(); ++f) {
    const Factor& factor = protocol_.factors[block.factors[f].factor];
    name.levels.emplace_back(factor.name, factor.levels[levels[f]].name);
  }
  return name;
}

bool Cells::set(json& value, const std::string& rest, const std::string& text,
                const std::string& place, const std::string& of) {
  try {
    const json::json_pointer pointer(rest);
    json& parent = value.at(pointer.parent_pointer());
    if (parent.is_array() ? !value.contains(pointer) : !parent.is_object()) throw InputError({});
    value[pointer] = palpate::read_json(text);
    return true;
  } catch (const json::exception&) {
  } catch (const InputError&) {
  }
  if (told_.insert(place).second) faults_.add(place, "expected a place that " + of + " has");
  return false;
}

int Cells::in_cell(const TaskBlock& block, const std::vector<std::size_t>& levels, int stimulus) {
  const std::string name = name_of(block, levels, stimulus).text();
  const auto [known, is_new] = known_.emplace(name, static_cast<int>(protocol_.stimuli.size()));
  if (!is_new) return known->second;
  json value = root_["stimuli"][static_cast<std::size_t>(stimulus)];
  const std::string plain = "'" + protocol_.stimuli[static_cast<std::size_t>(stimulus)].name + "'";
  std::vector<std::string> places;
  for (std::size_t f = 0; f < levels.size(); ++f) {
    const std::size_t factor = block.factors[f].factor;
    for (const auto& [pointer, text] : protocol_.factors[factor].levels[levels[f]].sets) {
      const Target target = *target_of(pointer);
      if (target.stimulus.empty() || !selects(target, protocol_, stimulus)) continue;
      places.push_back(pointer_of_set(factor, levels[f], pointer));
      set(value, target.rest, text, places.back(), plain);
    }
  }
  FaultList own(faults_.file());
  ObjectReader reader(value, "", own);
  StimulusSpec made = read_stimulus(reader, protocol_.material, files_);
  made.name = name;
  made.place = static_cast<std::size_t>(stimulus);
  try {
    own.throw_if_any();
  } catch (const InputError& error) {
    const Fault& fault = error.faults().front();
    // Of several places, name the one that set the faulty value.
    const auto at = std::ranges::find_if(places, [&](const std::string& place) {
      return one_holds_the_other(target_of(json::json_pointer(place).back())->rest, fault.location);
    });
    const std::string place = at != places.end() ? *at
                              : places.empty()   ? "/factors"
                                                 : places.back();
    if (told_.insert(place + fault.location).second)
      faults_.add(place, "in the cell " + name + ", at " + fault.location + ": " + fault.expected);
  }
  protocol_.stimuli.push_back(std::move(made));
  protocol_.stimulus_texts.push_back(value.dump());
  return known->second;
}

void Cells::put_cell(TaskBlock& block, const std::vector<std::size_t>& levels,
                     const TaskBlock& plain) {
  for (const int stimulus : plain.stimuli) {
    const int own = in_cell(plain, levels, stimulus);
    block.stimuli.push_back(own);
    if (plain.standard) block.standard_of[own] = in_cell(plain, levels, *plain.standard);
    if (plain.absent) block.absent_of[own] = in_cell(plain, levels, *plain.absent);
  }
}

TaskBlock Cells::block_in_cell(const TaskBlock& plain, std::size_t cell) {
  const std::vector<std::size_t> levels = levels_of_cell(plain, cell);
  json value = root_["blocks"][plain.place];
  std::string last;
  for (std::size_t f = 0; f < levels.size(); ++f) {
    const std::size_t factor = plain.factors[f].factor;
    for (const auto& [pointer, text] : protocol_.factors[factor].levels[levels[f]].sets) {
      const Target target = *target_of(pointer);
      if (!target.stimulus.empty()) continue;
      last = pointer_of_set(factor, levels[f], pointer);
      set(value, target.rest, text, last, "block '" + plain.name + "'");
    }
  }
  TaskBlock out = plain;
  if (!last.empty()) {
    FaultList own(faults_.file());
    ObjectReader reader(value, "", own);
    out = read_block(reader, protocol_);
    out.place = plain.place;
    try {
      own.throw_if_any();
    } catch (const InputError& error) {
      const Fault& fault = error.faults().front();
      if (told_.insert(last + fault.location).second)
        faults_.add(last,
                    "in block '" + plain.name + "', at " + fault.location + ": " + fault.expected);
    }
  }
  out.cell = cell;
  out.stimuli.clear();
  put_cell(out, levels, plain);
  return out;
}

/// Refuses what two factors set both, what the level varies, and the block's keys in mixed cells.
void Cells::check_sets(const TaskBlock& block) {
  struct Set {
    std::size_t factor;
    Target target;
    std::string place;
  };
  std::vector<Set> sets;
  for (const CrossedFactor& crossed : block.factors) {
    for (const std::size_t level : crossed.levels) {
      for (const auto& [pointer, text] : protocol_.factors[crossed.factor].levels[level].sets)
        sets.push_back(
            {crossed.factor, *target_of(pointer), pointer_of_set(crossed.factor, level, pointer)});
    }
  }
  const auto tell = [&](const std::string& place, const std::string& text) {
    if (told_.insert(place + text).second) faults_.add(place, text);
  };
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const Target& target = sets[i].target;
    for (std::size_t k = 0; k < i; ++k) {
      if (sets[k].factor != sets[i].factor && overlap(sets[k].target, target))
        tell(sets[i].place, "expected what no other factor sets; " + sets[k].place + " does");
    }
    if (target.stimulus.empty() && !block.cells_apart)
      tell(sets[i].place, "expected \"mixing\": \"blocked\" in block '" + block.name +
                              "': a block's own keys cannot change from trial to trial");
    for (const char* const key :
         {"/stimuli", "/standard", "/factors", "/mixing", "/shared", "/task", "/session",
          "/practice", "/absent", "/level", "/keys", "/procedure", "/renderers",
          // The meaning of an answer: cells are compared.
          "/asks", "/answer", "/intervals", "/scale", "/min", "/max", "/modulus", "/answers",
          "/catch_trials", "/order", "/repetitions"}) {
      if (target.stimulus.empty() && one_holds_the_other(target.rest, key))
        tell(sets[i].place,
             std::string("expected another key: all cells share '") + (key + 1) + "'");
    }
    const auto varies = [&](const LevelTarget& one) {
      return one_holds_the_other(target.rest, one.pointer);
    };
    if (!target.stimulus.empty() && std::ranges::any_of(targets_of(block), varies))
      tell(sets[i].place,
           "expected another key: block '" + block.name + "' varies it as its level");
    if (target.stimulus.empty() || target.stimulus == "*") continue;
    const bool known = std::ranges::any_of(
        protocol_.stimuli, [&](const StimulusSpec& s) { return s.name == target.stimulus; });
    if (!known)
      tell(sets[i].place,
           "expected '*' or the name of a stimulus, found '" + target.stimulus + "'");
  }
}

/// Refuses factors and sets without an effect.
void Cells::check_uses() {
  for (std::size_t f = 0; f < protocol_.factors.size(); ++f) {
    const std::vector<FactorLevel>& levels = protocol_.factors[f].levels;
    const std::string place = "/factors/" + std::to_string(f);
    for (std::size_t k = 1; k < levels.size(); ++k) {
      const auto same = std::ranges::find(levels, levels[k].sets, &FactorLevel::sets);
      if (same < levels.begin() + static_cast<std::ptrdiff_t>(k))
        faults_.add(place + "/levels/" + std::to_string(k) + "/set",
                    "expected other sets than those of the level '" + same->name + "'");
    }
    const auto crosses = [&](const TaskBlock& block) {
      return std::ranges::find(block.factors, f, &CrossedFactor::factor) != block.factors.end();
    };
    if (std::ranges::none_of(protocol_.blocks, crosses))
      faults_.add(place, "expected a block that crosses it ('factors' of a block)");
  }
}

void Cells::add_all() {
  for (const TaskBlock& block : protocol_.blocks) check_sets(block);
  check_uses();
  if (!faults_.empty()) return;
  std::vector<TaskBlock> all;
  for (const TaskBlock& plain : std::exchange(protocol_.blocks, {})) {
    if (plain.factors.empty()) {
      all.push_back(plain);
      continue;
    }
    const std::size_t cells = cells_of(plain);
    if (plain.cells_apart) {
      for (std::size_t cell = 0; cell < cells; ++cell) all.push_back(block_in_cell(plain, cell));
      continue;
    }
    TaskBlock& block = all.emplace_back(plain);
    block.stimuli.clear();
    for (std::size_t cell = 0; cell < cells; ++cell)
      put_cell(block, levels_of_cell(plain, cell), plain);
  }
  protocol_.blocks = std::move(all);
}

}  // namespace

std::size_t cells_of(const TaskBlock& block) {
  std::size_t cells = 1;
  for (const CrossedFactor& crossed : block.factors) cells *= crossed.levels.size();
  return cells;
}

void read_factors(ObjectReader& reader, Protocol& protocol) {
  if (!reader.has("factors")) {
    reader.member("factors");
    return;
  }
  const json* const list = reader.array("factors", 1, kMostFactors);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("factors"), i), reader.faults());
    read_factor(item, names, protocol.factors.emplace_back());
    item.refuse_unknown_keys();
  }
}

void read_crossing(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  reader.choice("mixing", block.cells_apart, {{"mixed", false}, {"blocked", true}});
  reader.boolean("shared", block.cells_share_tracks);
  const json* const value = reader.member("factors");
  if (value == nullptr) {
    if (reader.has("mixing"))
      reader.faults().add(reader.pointer("mixing"), "expected the factors whose cells it mixes");
    if (reader.has("shared"))
      reader.faults().add(reader.pointer("shared"),
                          "expected the factors whose cells share tracks");
    return;
  }
  if (block.cells_share_tracks && (block.cells_apart || !is_adaptive(block)))
    reader.faults().add(
        reader.pointer("shared"),
        block.cells_apart
            ? "expected no shared tracks with \"mixing\": \"blocked\""
            : "expected a procedure other than constant stimuli, whose tracks cells can share");
  if (!(value->is_array() || value->is_object()) || value->empty()) {
    reader.faults().add(reader.pointer("factors"),
                        "expected a list of factors, or an object of a list of levels for each" +
                            found_text(*value));
    return;
  }
  if (block.task == TaskKind::external) {
    reader.faults().add(reader.pointer("factors"),
                        "expected no factors: the program chooses the stimulus of every trial");
    return;
  }
  read_crossed(reader, *value, protocol, block);
  if (const std::size_t cells = cells_of(block); cells > kMostCells)
    reader.faults().add(reader.pointer("factors"), "expected at most " +
                                                       std::to_string(kMostCells) +
                                                       " cells, found " + std::to_string(cells));
}

void add_cells(const json& root, const MeshFiles& files, Protocol& protocol, FaultList& faults) {
  if (!protocol.factors.empty()) Cells(root, files, protocol, faults).add_all();
}

}  // namespace palpate::protocols
