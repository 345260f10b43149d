#include "protocols/tasks/parse_blocks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <iterator>
#include <set>
#include <utility>

#include "protocols/tasks/parse_answers.h"
#include "protocols/tasks/task_plan.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

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

/// \param none  null is allowed and means none
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

void read_level(ObjectReader& reader, TaskBlock& block) {
  reader.section("level", [&](ObjectReader& level) {
    LevelTarget target;
    const json* const path = level.member("path", Presence::required);
    const bool text = path != nullptr && path->is_string();
    target.pointer = text ? path->get<std::string>() : "";
    if (path != nullptr &&
        (target.pointer.size() < 2 || target.pointer.front() != '/' || target.pointer == "/name")) {
      level.faults().add(level.pointer("path"),
                         "expected a JSON pointer to a number of the stimulus, such as "
                         "'/stiffness_n_per_m' or '/layers/0/depth_m'" +
                             found_text(*path));
      target.pointer.clear();
    }
    target.orientation = target.pointer == "/orientation";
    if (target.orientation) {
      level.vector("axis", target.axis, {-1e3, 1e3}, Presence::required);
      if (glm::length(target.axis) > 1e-9) {
        target.axis = glm::normalize(target.axis);
      } else if (level.has("axis")) {
        level.faults().add(level.pointer("axis"), "expected an axis that is not zero");
      }
    }
    if (!target.pointer.empty()) block.level = target;
  });
}

/// Level and procedure, or repetitions.
void read_variation(ObjectReader& reader, TaskBlock& block) {
  read_level(reader, block);
  const bool varied = reader.has("level");
  if (block.task == TaskKind::adjust) {
    reader.integer("repetitions", block.repetitions, kManyTimes);
    if (!varied) reader.member("level", Presence::required);
    return;
  }
  read_procedures(reader, block.procedures);
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
                        "expected no repetitions beside a procedure, which says how many trials");
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

/// The levels that a program may ask for.
void read_external(ObjectReader& reader, TaskBlock& block) {
  reader.integer("trials", block.repetitions, kManyTimes, Presence::required);
  read_level(reader, block);
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
      read_external(reader, block);
      break;
  }
}

/// Whether it is practice, or until when.
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
                        "expected no criterion: the program says how many trials there are");
  } else if (block.task == TaskKind::rate || block.task == TaskKind::adjust) {
    reader.faults().add(reader.pointer("practice"),
                        "expected no criterion: no answer to this task is right or wrong");
  } else if (is_adaptive(block)) {
    reader.faults().add(reader.pointer("practice"),
                        "expected no criterion with an adaptive procedure, which keeps the share "
                        "of right answers where it is");
  }
}

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
                                          {"external", TaskKind::external}},
                                         Presence::required);
  if (!task) return block;  // its other keys depend on it
  block.task = *task;
  reader.integer("session", block.session, {1, 1000});
  read_practice(reader, block);
  reader.text("instructions", block.instructions);
  reader.text("question", block.question);
  read_block_renderers(reader, protocol, block);
  read_stimulus_names(reader, protocol, block);
  read_task_keys(reader, protocol, block);
  if (block.task != TaskKind::external) read_variation(reader, block);
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
  if (block.task != TaskKind::external) reader.boolean("feedback", block.feedback);
  if (block.feedback && (block.task == TaskKind::rate || block.task == TaskKind::adjust)) {
    reader.faults().add(reader.pointer("feedback"),
                        "expected no feedback: no answer to this task is right or wrong");
  }
  read_answers(reader, protocol, block);
  reader.refuse_unknown_keys();
  return block;
}

std::string block_pointer(std::size_t i) { return "/blocks/" + std::to_string(i); }

void check_names(ObjectReader& item, const std::string& name, std::set<std::string>& names) {
  if (!name.empty() && !names.insert(name).second)
    item.faults().add(item.pointer("name"),
                      "expected a name of its own, found '" + name + "' again");
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
                                                    ", as the block before it stands in session " +
                                                    std::to_string(session));
    }
    session = next;
  }
}

}  // namespace

void read_blocks(ObjectReader& reader, Protocol& protocol) {
  reader.choice("block_order", protocol.blocks_counterbalanced,
                {{"fixed", false}, {"counterbalanced", true}});
  const json* const list = reader.array("blocks", 1, kMaxBlocks, Presence::required);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("blocks"), i), reader.faults());
    protocol.blocks.push_back(read_block(item, protocol));
    check_names(item, protocol.blocks.back().name, names);
    protocol.sessions.count = std::max(protocol.sessions.count, protocol.blocks.back().session);
  }
  check_sessions(protocol, reader.faults());
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
