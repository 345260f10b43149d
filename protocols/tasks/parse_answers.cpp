#include "protocols/tasks/parse_answers.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include "protocols/answer_keys.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSteps = 11;  // of a scale
constexpr std::size_t kMostLabel = 80;
constexpr NumberRange kScaleNumber{-1e9, 1e9};
// Keys that mean the same in every task.
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

/// The answers of a task, in the order of their keys where a block names none.
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
    case TaskKind::external:
      break;
  }
  return answers;
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

/// 1, 2, ..., 9, 0, then letters: a key of its own for each step.
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

/// A key's answer: its name, or an object of answer and label.
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
  const bool goes_on = std::find(std::begin(kGoOn), std::end(kGoOn), key) != std::end(kGoOn);
  const std::string fault =
      goes_on ? "expected another key: '" + key + "' goes on in every task" : taken.add(key);
  if (!fault.empty()) faults.add(pointer, fault);
  std::string label;
  const std::size_t before = faults.count();
  const std::string name = read_answer_name(value, pointer, label, faults);
  const auto answer = std::find_if(answers.begin(), answers.end(),
                                   [&](const TaskAnswer& a) { return a.name == name; });
  if (answer == answers.end()) {
    std::string words;
    for (const TaskAnswer& a : answers) words += (words.empty() ? "'" : ", '") + a.name + "'";
    if (faults.count() == before)
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
                        "expected an object of an answer for each key" + found_text(*keys));
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

/// What another program may say; without a list the names of the stimuli.
void read_external_answers(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  constexpr std::size_t kMostAnswers = 100;
  const json* const list = reader.array("answers", 1, kMostAnswers);
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

/// The key that says what the answers are.
const char* answers_key(TaskKind task) {
  if (task == TaskKind::rate) return "scale";
  return task == TaskKind::external ? "answers" : "keys";
}

}  // namespace

void read_answers(ObjectReader& reader, const Protocol& protocol, TaskBlock& block) {
  if (block.task == TaskKind::rate) {
    read_rating(reader, block);
  } else if (block.task == TaskKind::external) {
    read_external_answers(reader, protocol, block);
  } else {
    read_answer_keys(reader, protocol, block);
  }
  std::set<std::string> labels;
  for (const TaskAnswer& answer : block.answers) {
    if (!labels.insert(answer.label).second) {
      reader.faults().add(
          reader.pointer(answers_key(block.task)),
          "expected a label of its own for each answer, found '" + answer.label + "' again");
    }
  }
  if (block.task == TaskKind::external) return;  // the program asks for it, if it wants to
  reader.section("confidence", [&](ObjectReader& section) {
    ConfidenceSpec& confidence = block.confidence.emplace();
    section.text("question", confidence.question);
    confidence.scale = read_scale_steps(section, "scale", Presence::required);
  });
}

}  // namespace palpate::protocols
