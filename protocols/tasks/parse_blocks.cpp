#include "protocols/tasks/parse_blocks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocols/answer_keys.h"
#include "protocols/factors.h"
#include "protocols/object_reader.h"
#include "protocols/order.h"
#include "protocols/parse_scene.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/block_trials.h"
#include "protocols/tasks/levels.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSteps = 11;  // of a scale
constexpr std::size_t kMostLabel = 80;
constexpr NumberRange kScaleNumber{-1e9, 1e9};
// Keys with the same meaning in every task.
constexpr const char* kGoOn[] = {"space", "enter"};

bool is_label(const std::string& text, std::size_t most) {
  return !text.empty() && text.size() <= most &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

void read_label(ObjectReader& reader, const char* key, std::string& label, Presence presence) {
  const json* const value = reader.member(key, presence);
  if (value == nullptr) return;
  label = value->is_string() ? value->get<std::string>() : "";
  if (is_label(label, kMostLabel)) return;
  reader.faults().add(reader.pointer(key), "expected a text of 1 to " + std::to_string(kMostLabel) +
                                               " bytes without control characters" +
                                               found_text(*value));
}

/// The answers of a task, in the order of their default keys.
std::vector<TaskAnswer> answers_of(const Protocol& protocol, const TaskBlock& block) {
  std::vector<TaskAnswer> answers;
  const auto add = [&](const std::string& name, const std::string& label = "") {
    const std::string number = std::to_string(answers.size() + 1);
    answers.push_back({number, name, label.empty() ? name : label, 0});
  };
  switch (block.task) {
    case TaskKind::identify:
      for (const int i : block.stimuli) add(protocol.stimuli[static_cast<std::size_t>(i)].name);
      break;
    case TaskKind::compare:
      if (block.same_different) {
        add("same");
        add("different");
      } else {
        for (int i = 1; i <= block.intervals; ++i) add(std::to_string(i));
      }
      break;
    case TaskKind::detect:
      add("yes");
      add("no");
      break;
    case TaskKind::rate:
      break;
    case TaskKind::adjust:
      add("down", "-");
      add("up", "+");
      add("switch");
      add("done");
      break;
    case TaskKind::reach:
      add("in_time", "in time");
      add("fast", "too fast");
      add("slow", "too slow");
      break;
    case TaskKind::external:
      break;
  }
  return answers;
}

/// 1, 2, ..., 9, 0, then letters: a separate key for each step.
std::string step_key(std::size_t i) {
  return i < 9    ? std::to_string(i + 1)
         : i == 9 ? "0"
                  : std::string(1, static_cast<char>('a' + i - 10));
}

void read_rating(ObjectReader& reader, TaskBlock& block) {
  const auto steps = read_scale_steps(reader, "scale", Presence::optional);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::string key = step_key(i);
    block.answers.push_back({key, key, steps[i].label, steps[i].number});
  }
  reader.number("min", block.least, kScaleNumber);
  reader.number("max", block.most, kScaleNumber);
  if (reader.has("scale") && (reader.has("min") || reader.has("max")))
    reader.faults().add(reader.pointer("scale"), "expected a scale, or min and max, not both");
  if (block.least && block.most && !(*block.least < *block.most))
    reader.faults().add(reader.pointer("max"), "expected more than min");
}

/// A key's answer: its name, or an object with answer and label.
std::string read_answer_name(const json& value, const std::string& pointer, std::string& label,
                             FaultList& faults) {
  if (value.is_string()) return value.get<std::string>();
  ObjectReader answer(value, pointer, faults);
  std::string name;
  answer.text("answer", name);
  answer.member("answer", Presence::required);
  read_label(answer, "label", label, Presence::optional);
  answer.refuse_unknown_keys();
  return name;
}

void read_key(const std::string& key, const json& value, const std::string& pointer,
              std::vector<TaskAnswer>& answers, std::set<std::string>& given, KeysTaken& taken,
              FaultList& faults) {
  const bool continues = std::find(std::begin(kGoOn), std::end(kGoOn), key) != std::end(kGoOn);
  const std::string fault =
      continues ? "expected another key: '" + key + "' continues in every task" : taken.add(key);
  if (!fault.empty()) faults.add(pointer, fault);
  std::string label;
  const std::size_t before = faults.count();
  const std::string name = read_answer_name(value, pointer, label, faults);
  const auto answer = std::find_if(answers.begin(), answers.end(),
                                   [&](const TaskAnswer& a) { return a.name == name; });
  if (answer == answers.end()) {
    std::string words;
    for (const TaskAnswer& a : answers) words += (words.empty() ? "'" : ", '") + a.name + "'";
    if (faults.count() == before && !answers.empty())
      faults.add(pointer, "expected one of the answers " + words + found_text(value));
    return;
  }
  if (!given.insert(name).second)
    faults.add(pointer, "expected one key for each answer; '" + name + "' has the key '" +
                            answer->key + "' already");
  answer->key = key;
  if (!label.empty()) answer->label = label;
}

void read_answer_keys(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  block.answers = answers_of(protocol, block);
  const json* const keys = reader.member("keys");
  if (keys == nullptr) return;
  const std::string pointer = reader.pointer("keys");
  if (!keys->is_object()) {
    reader.faults().add(pointer,
                        "expected an object with an answer for each key" + found_text(*keys));
    return;
  }
  std::set<std::string> given;
  KeysTaken taken;
  for (const auto& [key, value] : keys->items())
    read_key(key, value, child_pointer(pointer, key), block.answers, given, taken, reader.faults());
  for (const TaskAnswer& answer : block.answers) {
    if (!given.contains(answer.name))
      reader.faults().add(pointer, "no key for the answer '" + answer.name + "'");
  }
  std::sort(block.answers.begin(), block.answers.end(),
            [](const TaskAnswer& a, const TaskAnswer& b) { return a.key < b.key; });
}

/// Reads the answers that another program may give; by default the names of the stimuli, or the
/// numbers of the intervals where there are several.
void read_external_answers(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  constexpr std::size_t kMostAnswers = 100;
  const json* const list = reader.array("answers", 1, kMostAnswers);
  if (list == nullptr && block.intervals > 1) {
    for (int i = 1; i <= block.intervals; ++i)
      block.answers.push_back({"", std::to_string(i), std::to_string(i), 0});
    return;
  }
  if (list == nullptr) {
    for (const int i : block.stimuli) {
      const std::string& name = protocol.stimuli[static_cast<std::size_t>(i)].name;
      block.answers.push_back({"", name, name, 0});
    }
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& value = (*list)[i];
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    if (!is_label(text, kMostLabel)) {
      reader.faults().add(child_pointer(reader.pointer("answers"), i),
                          "expected a text of 1 to " + std::to_string(kMostLabel) +
                              " bytes without control characters" + found_text(value));
    }
    block.answers.push_back({"", text, text, 0});
  }
}

/// The key that defines the answers.
const char* answers_key(TaskKind task) {
  if (task == TaskKind::rate) return "scale";
  return task == TaskKind::external ? "answers" : "keys";
}

// Reads the possible answers in a block.
void read_answers(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  if (block.task == TaskKind::rate) {
    read_rating(reader, block);
  } else if (block.task == TaskKind::external) {
    read_external_answers(reader, protocol, block);
  } else if (block.task == TaskKind::reach) {
    block.answers = answers_of(protocol, block);  // the movement gives the answer, no key
  } else {
    read_answer_keys(reader, protocol, block);
  }
  std::set<std::string> labels;
  for (const TaskAnswer& answer : block.answers) {
    if (!labels.insert(answer.label).second) {
      reader.faults().add(
          reader.pointer(answers_key(block.task)),
          "expected a unique label for each answer, found '" + answer.label + "' again");
    }
  }
  if (block.task == TaskKind::external) return;  // the program may ask for it
  reader.section("confidence", [&](ObjectReader& section) {
    ConfidenceSpec& confidence = block.confidence.emplace();
    section.text("question", confidence.question);
    confidence.scale = read_scale_steps(section, "scale", Presence::required);
  });
}

constexpr long long kMostTaskTrials = 1000000;

void check_levels_of(const Protocol& protocol, const TaskBlock& block, const std::string& pointer,
                     FaultList& faults) {
  std::set<std::string> told;
  for (const int stimulus : block.stimuli) {
    for (const double level : levels_of(block)) {
      try {
        at_level(protocol, block, stimulus, level);
      } catch (const InputError& error) {
        const Fault& fault = error.faults().front();
        const std::string text =
            "expected a level that '" + protocol.stimuli[static_cast<std::size_t>(stimulus)].name +
            "' can have: at " + level_text(level) + ", " + fault.location + ": " + fault.expected;
        // Report each kind of fault for one level only.
        if (told.insert(protocol.stimuli[static_cast<std::size_t>(stimulus)].name + fault.location)
                .second)
          faults.add(pointer + "/level/path", text);
      }
    }
  }
}

void check_points_of(const Protocol& protocol, const TaskBlock& block, const std::string& pointer,
                     FaultList& faults) {
  std::set<std::string> told;
  check_points(
      protocol, block,
      [&](int stimulus, const LevelPoint& point, bool standard, const Fault& fault) {
        const std::string& name = protocol.stimuli[static_cast<std::size_t>(stimulus)].name;
        // Report each kind of fault for one point only.
        if (!told.insert(name + fault.location).second) return;
        const auto at_fault = std::ranges::find_if(block.dimensions, [&](const auto& one) {
          return one.applies_to(standard) && fault.location.starts_with(one.target.pointer);
        });
        const std::string place = at_fault != block.dimensions.end()
                                      ? "/level/dimensions/" +
                                            std::to_string(at_fault - block.dimensions.begin()) +
                                            "/path"
                                      : "/level/dimensions";
        faults.add(pointer + place, "expected levels that '" + name + "' can have: at " +
                                        point_text(block, point) + ", " + fault.location + ": " +
                                        fault.expected);
      });
}

/// The levels with more successes in two intervals, which follow from the question.
/// \return nullopt: the task does not determine them
std::optional<Easier> expected_easier(const Protocol& protocol, const TaskBlock& block) {
  if (block.task == TaskKind::compare && !block.same_different && !block.dimensions.empty())
    return block.asks_smaller ? Easier::lower : Easier::higher;
  if (block.task != TaskKind::compare || block.same_different || block.intervals > 2)
    return std::nullopt;
  if (const int side = side_of_levels(protocol, block); side != 0)
    return side > 0 ? Easier::higher : Easier::lower;
  if (!block.standard || !own_level(protocol, block, *block.standard)) return std::nullopt;
  return block.asks_smaller ? Easier::lower : Easier::higher;
}

void check_easier(const Protocol& protocol, const TaskBlock& block, const std::string& pointer,
                  FaultList& faults) {
  const std::optional<Easier> expected =
      block.level || !block.dimensions.empty() ? expected_easier(protocol, block) : std::nullopt;
  if (!expected) return;
  for (std::size_t i = 0; i < block.procedures.size(); ++i) {
    const std::optional<Easier> easier = easier_of(block.procedures[i]);
    if (!easier || *easier == *expected) continue;
    const bool one_side = side_of_levels(protocol, block) != 0;
    const std::string place =
        pointer + "/procedure" + (block.procedures.size() > 1 ? "/" + std::to_string(i) : "");
    faults.add(
        place + "/easier",
        std::string("expected '") + (*expected == Easier::higher ? "higher" : "lower") +
            (one_side ? "': all levels lie on one side of the standard, farther ones are easier"
                      : "': levels lie on both sides of the standard, and a success is an answer "
                        "that chooses the comparison"));
  }
}

constexpr std::size_t kMaxBlocks = 100;
constexpr NumberRange kAnyNumber{-1e9, 1e9};
constexpr NumberRange kManyTimes{1, 1e6};
constexpr NumberRange kWait{0, 60, "s"};
constexpr NumberRange kPresentation{0, 3600, "s", true};
constexpr NumberRange kShareOfTrials{0, 0.5};
constexpr int kPracticeLimit = 100;

std::optional<int> index_of(const Protocol& protocol, const std::string& name) {
  const auto at = std::find_if(protocol.stimuli.begin(), protocol.stimuli.end(),
                               [&](const StimulusSpec& s) { return s.name == name; });
  if (at == protocol.stimuli.end()) return std::nullopt;
  return static_cast<int>(std::distance(protocol.stimuli.begin(), at));
}

std::optional<int> read_stimulus_name(const json& value, const std::string& pointer,
                                      const Protocol& protocol, FaultList& faults) {
  const auto index =
      value.is_string() ? index_of(protocol, value.get<std::string>()) : std::nullopt;
  if (!index) faults.add(pointer, "expected the name of a stimulus" + found_text(value));
  return index;
}

void read_stimulus_names(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  const json* const list = reader.array("stimuli", 1, protocol.stimuli.size(), Presence::required);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("stimuli"), i);
    const auto index = read_stimulus_name((*list)[i], pointer, protocol, reader.faults());
    if (!index) continue;
    if (std::find(block.stimuli.begin(), block.stimuli.end(), *index) != block.stimuli.end())
      reader.faults().add(pointer, "expected each stimulus once" + found_text((*list)[i]));
    block.stimuli.push_back(*index);
  }
}

/// \param none  null is allowed and means no stimulus
std::optional<int> read_one_stimulus(ObjectReader& reader, const char* key,
                                     const Protocol& protocol, Presence presence, bool none) {
  const json* const value = reader.member(key, presence);
  if (value == nullptr || (none && value->is_null())) return std::nullopt;
  return read_stimulus_name(*value, reader.pointer(key), protocol, reader.faults());
}

bool read_renderer(const json& value, const std::string& pointer, const Protocol& protocol,
                   RendererKind& kind, FaultList& faults) {
  std::vector<std::pair<const char*, RendererKind>> options;
  options.reserve(protocol.renderers.size());
  for (const RendererKind one : protocol.renderers) options.emplace_back(to_string(one), one);
  return read_choice(value, pointer, kind, options, faults);
}

void read_block_renderers(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  const json* const list = reader.array("renderers", 1, 2);
  if (list == nullptr) {
    block.renderers = protocol.renderers;
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("renderers"), i);
    RendererKind kind{};
    if (!read_renderer((*list)[i], pointer, protocol, kind, reader.faults())) continue;
    if (std::find(block.renderers.begin(), block.renderers.end(), kind) != block.renderers.end())
      reader.faults().add(pointer, "expected each renderer once" + found_text((*list)[i]));
    block.renderers.push_back(kind);
  }
}

/// Level and procedure, or repetitions.
void read_variation(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  if (block.task == TaskKind::reach)
    return reader.integer("repetitions", block.repetitions, kManyTimes, Presence::required);
  const bool named = read_level(reader, block.level, block.dimensions);
  check_dimensions(reader, protocol, block);
  const bool varied = reader.has("level");
  if (block.task == TaskKind::adjust) {
    reader.integer("repetitions", block.repetitions, kManyTimes);
    if (!varied) reader.member("level", Presence::required);
    return;
  }
  if (named)
    read_procedures(reader, block.dimensions, block.procedures);
  else
    reader.member("procedure");
  const bool procedural = varied || reader.has("procedure");
  if (varied != reader.has("procedure")) {
    reader.faults().add(reader.pointer(varied ? "procedure" : "level"),
                        varied ? "expected the procedure that chooses the levels"
                               : "expected the number that the procedure varies");
  }
  reader.integer("repetitions", block.repetitions, kManyTimes,
                 procedural ? Presence::optional : Presence::required);
  if (procedural && reader.has("repetitions")) {
    reader.faults().add(reader.pointer("repetitions"),
                        "expected no repetitions: the procedure determines the number of trials");
  }
}

void read_compare(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  block.standard = read_one_stimulus(reader, "standard", protocol, Presence::required, false);
  if (const json* const other = reader.member("standard_renderer")) {
    RendererKind kind{};
    if (read_renderer(*other, reader.pointer("standard_renderer"), protocol, kind, reader.faults()))
      block.standard_renderer = kind;
  }
  reader.integer("intervals", block.intervals, {2, 3});
  reader.choice("answer", block.same_different, {{"interval", false}, {"same_different", true}});
  reader.choice("asks", block.asks_smaller, {{"larger", false}, {"smaller", true}});
  using IntervalsSeen = TaskBlock::IntervalsSeen;
  reader.choice("intervals_seen", block.intervals_seen,
                {{"both", IntervalsSeen::both},
                 {"standard", IntervalsSeen::standard},
                 {"comparison", IntervalsSeen::comparison}});
  reader.number("inter_interval_s", block.inter_interval, kWait);
  reader.number("interval_limit_s", block.interval_limit, kPresentation);
  if (block.same_different) block.catch_trials = 0.5;
  reader.number("catch_trials", block.catch_trials, kShareOfTrials);
  if (!block.same_different && block.catch_trials > 0) {
    reader.faults().add(reader.pointer("catch_trials"),
                        "expected catch trials with the answer 'same_different' only: without a "
                        "comparison no interval is right");
  }
  if (block.same_different && block.intervals != 2)
    reader.faults().add(reader.pointer("intervals"), "expected 2 with 'same_different'");
}

void read_rate(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  block.standard = read_one_stimulus(reader, "standard", protocol, Presence::optional, false);
  reader.number("modulus", block.modulus, {0, 1e9, "", true});
  if (reader.has("modulus") && !block.standard) {
    reader.faults().add(reader.pointer("standard"),
                        "expected the stimulus whose number the modulus is");
  }
  if (block.standard) {
    reader.number("inter_interval_s", block.inter_interval, kWait);
    reader.number("interval_limit_s", block.interval_limit, kPresentation);
  }
}

void read_adjust(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  block.standard = read_one_stimulus(reader, "standard", protocol, Presence::required, false);
  double least = 0, most = 0;
  reader.number("min", least, kAnyNumber, Presence::required);
  reader.number("max", most, kAnyNumber, Presence::required);
  reader.number("turn", block.turn, {0, 1e9, "", true}, Presence::required);
  if (!(least < most) && reader.has("min") && reader.has("max"))
    reader.faults().add(reader.pointer("max"), "expected more than min");
  block.least = least;
  block.most = std::max(least, most);
  const json* const starts = reader.array("starts", 1, 1000, Presence::required);
  if (starts == nullptr) return;
  for (std::size_t i = 0; i < starts->size(); ++i) {
    double start = 0;
    if (read_number((*starts)[i], child_pointer(reader.pointer("starts"), i), start,
                    {least, *block.most}, reader.faults()))
      block.starts.push_back(start);
  }
}

/// Reads the levels that a program may ask for.
void read_external(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  constexpr int kMostIntervals = 10;
  reader.integer("trials", block.repetitions, kManyTimes, Presence::required);
  block.intervals = 1;
  reader.integer("intervals", block.intervals, {1, kMostIntervals});
  if (block.intervals > 1) {
    reader.number("inter_interval_s", block.inter_interval, kWait);
    reader.number("interval_limit_s", block.interval_limit, kPresentation);
  }
  read_level(reader, block.level, block.dimensions);
  check_dimensions(reader, protocol, block);
  const Presence presence = block.level ? Presence::required : Presence::optional;
  double least = 0, most = 0;
  reader.number("min", least, kAnyNumber, presence);
  reader.number("max", most, kAnyNumber, presence);
  for (const char* const key : {"min", "max"}) {
    if (reader.has(key) && !reader.has("level"))
      reader.faults().add(reader.pointer(key), "expected the level whose range it limits");
  }
  if (!block.level) return;
  if (!(least < most) && reader.has("min") && reader.has("max"))
    reader.faults().add(reader.pointer("max"), "expected more than min");
  block.least = least;
  block.most = std::max(least, most);
}

constexpr NumberRange kPlace{-0.5, 0.5, "m"};
constexpr NumberRange kReachRadius{0.001, 0.05, "m"};
constexpr std::size_t kMostTargets = 32;

bool read_place(const json& value, const std::string& pointer, Vec3& out, FaultList& faults) {
  if (!value.is_array() || value.size() != 3) {
    faults.add(pointer, "expected a place [x, y, z] in m" + found_text(value));
    return false;
  }
  bool read = true;
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    read &= read_number(value[at], child_pointer(pointer, at), out[k], kPlace, faults);
  }
  return read;
}

void read_targets(ObjectReader& reader, ReachingSpec& reaching) {
  const json* const list = reader.array("targets_m", 1, kMostTargets, Presence::required);
  if (list == nullptr) return;
  const double apart = reaching.home_radius + reaching.target_radius;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("targets_m"), i);
    Vec3 target(0);
    if (!read_place((*list)[i], pointer, target, reader.faults())) continue;
    if (!(glm::length(target - reaching.home) > apart))
      reader.faults().add(pointer,
                          "expected a target more than home_radius_m and target_radius_m away "
                          "from home");
    if (std::find(reaching.targets.begin(), reaching.targets.end(), target) !=
        reaching.targets.end())
      reader.faults().add(pointer, "expected each target once");
    reaching.targets.push_back(target);
  }
}

void read_time_window(ObjectReader& reader, ReachingSpec& reaching) {
  constexpr NumberRange kMovement{0, 60, "s"};
  const json* const window = reader.array("time_window_s", 2, 2);
  if (window == nullptr) return;
  double least = 0, most = 0;
  const std::string pointer = reader.pointer("time_window_s");
  const bool read = read_number((*window)[0], child_pointer(pointer, std::size_t{0}), least,
                                kMovement, reader.faults()) &
                    read_number((*window)[1], child_pointer(pointer, std::size_t{1}), most,
                                kMovement, reader.faults());
  if (!read) return;
  if (!(least < most))
    reader.faults().add(child_pointer(pointer, std::size_t{1}), "expected more than the first");
  reaching.least_time = least;
  reaching.most_time = most;
}

void read_reach_task(ObjectReader& reader, TaskBlock& block) {
  constexpr NumberRange kChannel{50, 20000, "N/m"};
  ReachingSpec& reaching = block.reaching.emplace();
  reader.vector("home_m", reaching.home, kPlace);
  reader.number("home_radius_m", reaching.home_radius, kReachRadius);
  reader.number("target_radius_m", reaching.target_radius, kReachRadius);
  read_targets(reader, reaching);
  read_time_window(reader, reaching);
  reader.number("clamp_share", reaching.clamp_share, kShareOfTrials);
  reader.number("catch_share", reaching.catch_share, kShareOfTrials);
  reader.number("clamp_stiffness_n_per_m", reaching.clamp_stiffness, kChannel);
  if (reaching.clamp_share + reaching.catch_share > 0.5)
    reader.faults().add(reader.pointer("catch_share"),
                        "expected at most half of all trials together with clamp_share");
}

/// Faults what only all keys of a block of reaching tell.
void check_reach(ObjectReader& reader, const TaskBlock& block) {
  const ReachingSpec& reaching = *block.reaching;
  if (reaching.most_time && !(block.time_out > *reaching.most_time))
    reader.faults().add(reader.pointer("time_out_s"),
                        "expected more than the longest time of time_window_s");
  const auto trials =
      static_cast<double>(block.repetitions) * static_cast<double>(reaching.targets.size());
  const auto check = [&](const char* key, double share) {
    if (share > 0 && !reaching.targets.empty() && share * trials < 0.5)
      reader.faults().add(reader.pointer(key),
                          "expected a share that is a trial or more of each stimulus");
  };
  check("clamp_share", reaching.clamp_share);
  check("catch_share", reaching.catch_share);
}

void read_task_keys(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  switch (block.task) {
    case TaskKind::identify:
      break;
    case TaskKind::compare:
      read_compare(reader, protocol, block);
      break;
    case TaskKind::detect:
      block.absent = read_one_stimulus(reader, "absent", protocol, Presence::optional, true);
      reader.number("catch_trials", block.catch_trials, kShareOfTrials);
      break;
    case TaskKind::rate:
      read_rate(reader, protocol, block);
      break;
    case TaskKind::adjust:
      read_adjust(reader, protocol, block);
      break;
    case TaskKind::external:
      read_external(reader, protocol, block);
      break;
    case TaskKind::reach:
      read_reach_task(reader, block);
      break;
  }
}

/// Whether the block is practice, and its criterion.
void read_practice(ObjectReader& reader, TaskBlock& block) {
  const json* const value = reader.member("practice");
  if (value == nullptr) return;
  if (!value->is_object()) return reader.boolean("practice", block.practice);
  block.practice = true;
  reader.section("practice", [&](ObjectReader& practice) {
    PracticeCriterion criterion;
    criterion.most_trials = kPracticeLimit;
    practice.section(
        "criterion",
        [&](ObjectReader& section) {
          section.integer("correct", criterion.correct, {1, 1000}, Presence::required);
          section.integer("of", criterion.of, {1, 1000}, Presence::required);
          if (criterion.correct > criterion.of) {
            section.faults().add(section.pointer("correct"),
                                 "expected at most as many as 'of', the last answers that count");
          }
        },
        Presence::required);
    practice.integer("limit", criterion.most_trials, {1, 10000});
    if (criterion.most_trials < criterion.of) {
      practice.faults().add(practice.pointer("limit"),
                            "expected at least as many trials as the criterion counts");
    }
    block.criterion = criterion;
  });
}

void check_practice(ObjectReader& reader, const TaskBlock& block) {
  if (!block.criterion) return;
  if (block.task == TaskKind::external) {
    reader.faults().add(reader.pointer("practice"),
                        "expected no criterion: the program determines the number of trials");
  } else if (block.task == TaskKind::rate || block.task == TaskKind::adjust) {
    reader.faults().add(reader.pointer("practice"),
                        "expected no criterion: no answer to this task is right or wrong");
  } else if (is_adaptive(block)) {
    reader.faults().add(
        reader.pointer("practice"),
        "expected no criterion with an adaptive procedure, which keeps the share of right answers "
        "constant");
  }
}

std::string block_pointer(std::size_t i) { return "/blocks/" + std::to_string(i); }

void check_names(ObjectReader& item, const std::string& name, std::set<std::string>& names) {
  if (!name.empty() && !names.insert(name).second)
    item.faults().add(item.pointer("name"), "expected a unique name, found '" + name + "' again");
}

void check_sessions(const Protocol& protocol, FaultList& faults) {
  int session = 1;
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const int next = protocol.blocks[i].session;
    if (i == 0 && next != 1) {
      faults.add(block_pointer(i) + "/session", "expected session 1 of the first block");
    } else if (next != session && next != session + 1) {
      faults.add(block_pointer(i) + "/session", "expected session " + std::to_string(session) +
                                                    " or " + std::to_string(session + 1) +
                                                    ", as the previous block is in session " +
                                                    std::to_string(session));
    }
    session = next;
  }
}

}  // namespace

TaskBlock read_block(ObjectReader& reader, const Protocol& protocol) {
  TaskBlock block;
  std::optional<TaskKind> task;
  reader.name("name", block.name);
  reader.choice<std::optional<TaskKind>>("task", task,
                                         {{"identify", TaskKind::identify},
                                          {"compare", TaskKind::compare},
                                          {"detect", TaskKind::detect},
                                          {"rate", TaskKind::rate},
                                          {"adjust", TaskKind::adjust},
                                          {"external", TaskKind::external},
                                          {"reach", TaskKind::reach}},
                                         Presence::required);
  if (!task) return block;  // the other keys depend on it
  block.task = *task;
  reader.integer("session", block.session, {1, 1000});
  read_practice(reader, block);
  reader.text("instructions", block.instructions);
  reader.text("question", block.question);
  read_block_renderers(reader, protocol, block);
  read_stimulus_names(reader, protocol, block);
  read_task_keys(reader, protocol, block);
  if (block.task != TaskKind::external) read_variation(reader, protocol, block);
  check_practice(reader, block);
  if (block.task != TaskKind::external)
    reader.section("order", [&](ObjectReader& order) {
      order.integer("max_run", block.max_run, kManyTimes);
      order.integer("min_distance", block.min_distance, kManyTimes);
    });
  reader.number("time_out_s", block.time_out, kPresentation);
  if (block.interval_limit && !(block.time_out > *block.interval_limit)) {
    reader.faults().add(reader.pointer("time_out_s"),
                        "expected more than interval_limit_s: the time for the answer begins with "
                        "the last interval");
  }
  if (block.reaching) check_reach(reader, block);
  if (block.task != TaskKind::external) reader.boolean("feedback", block.feedback);
  if (block.feedback && (block.task == TaskKind::rate || block.task == TaskKind::adjust)) {
    reader.faults().add(reader.pointer("feedback"),
                        "expected no feedback: no answer to this task is right or wrong");
  }
  read_answers(reader, protocol, block);
  read_crossing(reader, protocol, block);
  reader.refuse_unknown_keys();
  return block;
}

std::vector<ScaleStep> read_scale_steps(ObjectReader& reader, const char* key, Presence presence) {
  std::vector<ScaleStep> steps;
  const json* const list = reader.array(key, 2, kMostSteps, presence);
  if (list == nullptr) return steps;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer(key), i), reader.faults());
    ScaleStep step{static_cast<double>(i + 1), ""};
    item.number("number", step.number, kScaleNumber);
    read_label(item, "label", step.label, Presence::required);
    item.refuse_unknown_keys();
    if (!steps.empty() && step.number <= steps.back().number)
      reader.faults().add(item.pointer("number"), "expected more than the step before");
    steps.push_back(std::move(step));
  }
  return steps;
}

// Checks that the blocks of a protocol can be shown.

void check_blocks(const Protocol& protocol, FaultList& faults) {
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const TaskBlock& block = protocol.blocks[i];
    check_levels_of(protocol, block, block_pointer(protocol.blocks[i].place), faults);
    check_points_of(protocol, block, block_pointer(protocol.blocks[i].place), faults);
    if (block.level && block.task != TaskKind::detect && block.standard &&
        !own_level(protocol, block, *block.standard)) {
      faults.add(block_pointer(protocol.blocks[i].place) + "/standard",
                 "expected a stimulus that has " + block.level->pointer + " itself");
    }
  }
  faults.throw_if_any();
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i)
    check_easier(protocol, protocol.blocks[i], block_pointer(protocol.blocks[i].place), faults);
  long long trials = 0;
  for (const TaskBlock& block : protocol.blocks) trials += most_trials_of(block);
  if (trials > kMostTaskTrials) {
    faults.add("/blocks", "expected at most " + std::to_string(kMostTaskTrials) +
                              " trials for each participant, found " + std::to_string(trials));
    return;
  }
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    try {
      check_order(protocol, static_cast<int>(i));
    } catch (const ScheduleError& error) {
      faults.add(block_pointer(protocol.blocks[i].place) + "/order", error.what());
    }
  }
}

void add_channels(Protocol& protocol) {
  std::size_t number = 0;
  for (TaskBlock& block : protocol.blocks) {
    if (!block.reaching || block.reaching->clamp_share == 0) continue;
    ReachingSpec& reaching = *block.reaching;
    reaching.channels.clear();
    for (const Vec3& target : reaching.targets) {
      StimulusSpec channel;
      channel.name = "channel " + std::to_string(++number);
      channel.place = protocol.stimuli[static_cast<std::size_t>(block.stimuli.front())].place;
      channel.object.shape = stimuli::ShapeKind::none;
      channel.object.material = protocol.material;
      stimuli::FieldSpec& field = channel.object.fields.emplace_back();
      field.kind = stimuli::FieldSpec::Kind::channel;
      field.centre = reaching.home;
      field.to = target;
      field.stiffness = reaching.clamp_stiffness;
      reaching.channels.push_back(static_cast<int>(protocol.stimuli.size()));
      const auto list = [](const Vec3& v) { return json{v.x, v.y, v.z}; };
      const json text = {{"name", channel.name},
                         {"shape", "none"},
                         {"fields",
                          {{{"kind", "channel"},
                            {"from_m", list(reaching.home)},
                            {"to_m", list(target)},
                            {"stiffness_n_per_m", reaching.clamp_stiffness}}}}};
      protocol.stimulus_texts.push_back(text.dump());
      protocol.stimuli.push_back(std::move(channel));
    }
  }
}

void check_reaching(const Protocol& protocol, FaultList& faults) {
  const bool any = std::any_of(protocol.blocks.begin(), protocol.blocks.end(),
                               [](const TaskBlock& block) { return block.reaching.has_value(); });
  if (!any) return;
  if (!protocol.samples)
    faults.add("/samples", "expected true: the measures of task 'reach' come from its samples");
  if (protocol.reach) faults.add("/reach", "expected no extended probe with task 'reach'");
}

void read_blocks(ObjectReader& reader, Protocol& protocol) {
  reader.choice("block_order", protocol.blocks_counterbalanced,
                {{"fixed", false}, {"counterbalanced", true}});
  const json* const list = reader.array("blocks", 1, kMaxBlocks, Presence::required);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("blocks"), i), reader.faults());
    protocol.blocks.push_back(read_block(item, protocol));
    protocol.blocks.back().place = i;
    check_names(item, protocol.blocks.back().name, names);
    protocol.sessions.count = std::max(protocol.sessions.count, protocol.blocks.back().session);
  }
  check_sessions(protocol, reader.faults());
  check_shared_dimensions(protocol, reader.faults());
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const TaskBlock& block = protocol.blocks[i];
    if (is_adaptive(block) && (block.max_run || block.min_distance)) {
      reader.faults().add(block_pointer(i) + "/order",
                          "expected no limits on the order: answers choose the levels of an "
                          "adaptive procedure");
    }
  }
}

}  // namespace palpate::protocols
