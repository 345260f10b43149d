#include "data/export/dataset_description.h"

#include <algorithm>
#include <set>
#include <span>
#include <string_view>

#include "data/base/words.h"
#include "data/export/exported_columns.h"
#include "data/export/page_table.h"
#include "data/files/text_sink.h"

namespace palpate::data {
namespace {

void describe_table(const char* table, std::span<const Column> columns, const ProtocolFacts& facts,
                    const ExportSettings& settings, std::vector<CodebookRow>& out) {
  for (const Column& column : columns) {
    const std::string unit = unit_of(column, facts);
    out.push_back({table, column.name, unit, "", column.description});
    for (const auto& values :
         {column_levels(column, facts), column_bits(column, settings.fault_bits)}) {
      // Names of stimuli are guarded already.
      for (const auto& [value, meaning] : values.items())
        out.push_back(
            {table, column.name, unit, std::string(unguarded(value)), meaning.get<std::string>()});
    }
  }
}

bool is_alphanumeric(char c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

std::string only_alphanumeric(std::string_view text) {
  std::string kept;
  std::copy_if(text.begin(), text.end(), std::back_inserter(kept), is_alphanumeric);
  return kept;
}

/// File name in the protocol (any path) -> a unique portable base name in the dataset.
std::map<std::string, std::string> file_names(const std::vector<ProtocolFile>& files) {
  constexpr std::size_t kLongest = 100;
  std::map<std::string, std::string> names;
  std::set<std::string> taken;
  for (const ProtocolFile& file : files) {
    std::string name = file.name.substr(file.name.find_last_of('/') + 1);
    for (char& c : name) {
      if (!is_alphanumeric(c) && c != '.' && c != '-') c = '_';
    }
    if (name.empty() || name[0] == '.') name = "_" + name;
    if (name.size() > kLongest) name.erase(0, name.size() - kLongest);
    std::string unique = name;
    for (int k = 2; !taken.insert(lower_case(unique)).second; ++k) {
      unique = std::to_string(k) + "_" + name;
    }
    names[file.name] = unique;
  }
  return names;
}

void add_stimuli(nlohmann::ordered_json& levels, const ProtocolFacts& facts) {
  for (const StimulusFacts& stimulus : facts.stimuli)
    levels[guarded_text(stimulus.name)] = "stimulus of the protocol";
}

/// Adds no codes if some answers are numbers.
void add_answers(nlohmann::ordered_json& levels, const ProtocolFacts& facts) {
  std::set<std::string> tasks;
  for (const BlockFacts& block : facts.blocks) tasks.insert(block.task);
  if (tasks.contains("rate") || tasks.contains("adjust")) return;
  if (tasks.contains("compare")) {
    for (const char* interval : {"1", "2", "3"}) levels[interval] = "that interval";
    levels["same"] = "the intervals were the same";
    levels["different"] = "they were not";
  }
  if (tasks.contains("detect")) {
    levels["yes"] = "there was something";
    levels["no"] = "there was nothing";
  }
  if (tasks.contains("reach")) {
    levels["in_time"] = "the movement took as long as asked";
    levels["fast"] = "less than that";
    levels["slow"] = "more than that";
  }
  if (tasks.empty() || tasks.contains("identify")) add_stimuli(levels, facts);
}

}  // namespace

std::vector<CodebookRow> codebook_rows(const ProtocolFacts& facts, const ExportSettings& settings,
                                       const ExportClock& clock) {
  std::vector<CodebookRow> out = {{"table", "column", "unit", "value", "meaning"}};
  describe_table("trials", trial_columns(clock), facts, settings, out);
  describe_table("attempts", attempt_columns(clock), facts, settings, out);
  if (!settings.pages) return out;
  describe_table("pages", page_columns(), facts, settings, out);
  for (const auto& [place, question] : facts.questions)
    out.push_back({"pages", "item", "", place, question});
  return out;
}

void write_protocol_files(Store& store, const StudyLabel& study, const std::string& folder,
                          const AtomicFolder& draft) {
  if (study.files.empty()) return;
  for (const ProtocolFile& file : store.files(study.protocol.sha256)) {
    FileSink out(draft.prepare(folder + "/" + study.label + "/" + study.files.at(file.name)));
    out.write(file.bytes);
    out.close(false);
  }
}

std::map<std::string, StudyLabel> label_protocols(Store& store, const ExportSettings& settings) {
  constexpr std::size_t kLongest = 64;  // of a name: file systems allow 255 bytes
  std::map<std::string, StudyLabel> labels;
  std::map<std::string, int> uses;
  for (const ProtocolInfo& protocol : store.protocols()) {
    StudyLabel& study = labels[protocol.sha256];
    study.protocol = protocol;
    study.label = only_alphanumeric(protocol.name).substr(0, kLongest);
    if (study.label.empty()) study.label = "task";
    if (settings.facts) study.facts = settings.facts(protocol);
    study.files = file_names(store.files(protocol.sha256));
    ++uses[lower_case(study.label)];
  }
  for (auto& [sha256, study] : labels) {
    if (uses[lower_case(study.label)] == 1) continue;
    study.label += "x" + only_alphanumeric(sha256);
  }
  return labels;
}

void require_exportable(Store& store) {
  if (store.counts().completed == 0) {
    throw StoreRefused(store.path() + ": has no completed trials; there is nothing to export");
  }
  std::map<std::string, std::string> seen;  // in lower case -> as it is
  for (const ProtocolInfo& protocol : store.protocols()) {
    for (const Participant& person : store.participants(protocol.sha256)) {
      const auto [at, added] = seen.emplace(lower_case(person.code), person.code);
      if (added || at->second == person.code) continue;
      throw StoreRefused(store.path() + ": the participants " + at->second + " and " + person.code +
                         " differ in case only, which names of files in a dataset must not; "
                         "export as csv");
    }
  }
}

std::string dataset_name(const std::map<std::string, StudyLabel>& labels, bool simulated) {
  std::set<std::string> names;
  for (const auto& [sha256, study] : labels) names.insert(study.protocol.name);
  std::string name;
  for (const auto& one : names) name += (name.empty() ? "" : ", ") + one;
  return name + (simulated ? " (SIMULATED participants)" : "");
}

std::string dataset_description(const std::map<std::string, StudyLabel>& labels, bool simulated) {
  std::string text = dataset_form(all_facts(labels)).study;
  text += " by touch through a force-feedback stylus, one row a trial, recorded by palpate.";
  for (const auto& [sha256, study] : labels) {
    if (!study.facts.title.empty())
      text += " " + study.protocol.name + ": " + study.facts.title + ".";
  }
  return text + (simulated ? std::string(" ") + kSimulatedSentence : "");
}

nlohmann::ordered_json column_levels(const Column& column, const ProtocolFacts& facts) {
  nlohmann::ordered_json levels;
  for (const auto& [value, meaning] : column.levels) levels[value] = meaning;
  if (column.names == Column::Names::stimuli) {
    add_stimuli(levels, facts);
  } else if (column.names == Column::Names::answers) {
    add_answers(levels, facts);
  } else if (column.names == Column::Names::blocks) {
    for (const BlockFacts& block : facts.blocks) {
      std::string meaning =
          block.task + (block.level_path.empty()
                            ? ""
                            : "; levels of " + block.level_path + " in " + block.level_unit);
      for (const BlockFacts::Dimension& one : block.dimensions)
        meaning += "; " + one.name + ": levels of " + one.path + " in " + one.unit;
      levels[guarded_text(block.name)] = meaning;
    }
  }
  return levels;
}

std::string unit_of(const Column& column, const ProtocolFacts& facts) {
  if (std::string_view(column.unit) != Column::kLevelUnit) return column.unit;
  std::set<std::string> units, named;
  for (const BlockFacts& block : facts.blocks) {
    for (const BlockFacts::Dimension& one : block.dimensions)
      if (one.name == column.name) named.insert(one.unit);
    if (!block.level_unit.empty()) units.insert(block.level_unit);
  }
  if (named.size() == 1) return *named.begin();
  return units.size() == 1 && named.empty() ? *units.begin() : column.unit;
}

nlohmann::ordered_json column_bits(const Column& column,
                                   const std::vector<FaultMeaning>& fault_bits) {
  nlohmann::ordered_json bits;
  if (std::string_view(column.name) != "faults") return bits;
  for (const FaultMeaning& fault : fault_bits) bits[std::to_string(fault.bit)] = fault.text;
  return bits;
}

nlohmann::ordered_json describe_column(const Column& column, const ProtocolFacts& facts,
                                       const std::vector<FaultMeaning>& fault_bits) {
  nlohmann::ordered_json json{{"Description", column.description}};
  if (*column.unit != '\0') json["Units"] = unit_of(column, facts);
  if (const auto levels = column_levels(column, facts); !levels.is_null()) json["Levels"] = levels;
  if (const auto bits = column_bits(column, fault_bits); !bits.is_null()) json["Bits"] = bits;
  return json;
}

ProtocolFacts all_facts(const std::map<std::string, StudyLabel>& labels) {
  ProtocolFacts facts;
  for (const auto& [sha256, study] : labels) {
    facts.stimuli.insert(facts.stimuli.end(), study.facts.stimuli.begin(),
                         study.facts.stimuli.end());
    facts.blocks.insert(facts.blocks.end(), study.facts.blocks.begin(), study.facts.blocks.end());
    facts.questions.insert(facts.questions.end(), study.facts.questions.begin(),
                           study.facts.questions.end());
  }
  return facts;
}

std::string guarded_text(std::string_view text) {
  return (needs_guard(text) ? "'" : "") + std::string(text);
}

std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void DatasetWriter::write(const std::string& name, const std::string& text) {
  FileSink file(folder_.prepare(name));
  file.write(text);
  file.close(false);
}

}  // namespace palpate::data
