#include "analysis/input/study_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

#include "analysis/input/csv_reader.h"
#include "analysis/input/study_record.h"
#include "analysis/input/trials.h"
#include "analysis/text.h"
#include "data/base/cell_name.h"
#include "data/base/column_names.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/base/words.h"
#include "data/files/text_sink.h"
#include "data/store/participant_groups.h"
#include "data/store/store.h"
#include "data/store/task_text.h"
#include "data/stored_protocol.h"
#include "protocols/groups.h"
#include "protocols/parse.h"

namespace palpate::analysis {
namespace {

using Columns = std::map<std::string, std::size_t, std::less<>>;
constexpr std::size_t kMostTaskFaults = 50;
const std::vector<std::string_view> kTaskColumns{
    "participant_id",  "task",          "renderer",        "shape",
    "response",        "level",         "success",         "standard_level",
    "correct",         "catch_trial",   "number",          "confidence",
    "block_name",      "track",         "practice",        "timed_out",
    "simulated",       "session",       "block",           "trial",
    "response_time",   "protocol_name", "protocol_sha256", "comparison_interval",
    "interval_onsets", "torque_driven", "program_version", "group"};
const char* const kTasks[] = {"identify", "compare",  "detect", "rate",
                              "adjust",   "external", "reach"};

/// \param twice  receives the names of known columns that come again; nullptr: they do not matter
Columns read_header(CsvReader& reader, std::vector<std::string>* twice = nullptr) {
  Columns columns;
  if (!reader.next()) return columns;
  for (std::size_t i = 0; i < reader.fields().size(); ++i) {
    const std::string name(reader.fields()[i]);
    const bool is_new = columns.emplace(name, i).second;
    if (!is_new && twice != nullptr && std::ranges::find(kTaskColumns, name) != kTaskColumns.end())
      twice->push_back(name);
  }
  return columns;
}

/// One record by column names, faults with their line.
class TaskRow {
 public:
  TaskRow(const std::string& file, const Columns& columns, const CsvReader& reader,
          std::vector<protocols::Fault>& faults)
      : file_(file), columns_(columns), reader_(reader), faults_(faults) {}

  std::string_view text(std::string_view column) const {
    const auto place = columns_.find(column);
    if (place == columns_.end() || place->second >= reader_.fields().size()) return {};
    return data::unguarded(reader_.fields()[place->second]);
  }
  /// "" also for missing values as other programs write them.
  std::string_view value(std::string_view column) const {
    const std::string_view field = text(column);
    return is_missing(field) ? std::string_view() : field;
  }
  /// A hint for a missing column, if another resembles it.
  std::string hint(std::string_view column) const {
    std::vector<std::string> found;
    for (const auto& [name, place] : columns_) found.push_back(name);
    return hint_for(column, alike_columns(found, kTaskColumns));
  }
  bool has(std::string_view column) const { return columns_.find(column) != columns_.end(); }

  std::optional<double> number(std::string_view column) {
    const std::string_view field = value(column);
    if (field.empty()) return std::nullopt;
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    constexpr double kMost = 1e15;
    if (error == std::errc() && end == field.data() + field.size() && std::abs(value) <= kMost)
      return value;
    add_fault(column, "expected a number from -1e15 to 1e15, or nothing");
    return std::nullopt;
  }

  /// A whole number from 1; 1 if missing.
  int whole(std::string_view column) {
    const std::string_view field = value(column);
    int value = 1;
    if (field.empty()) return value;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error == std::errc() && end == field.data() + field.size() && value >= 1) return value;
    add_fault(column, "expected a whole number from 1, or nothing");
    return 1;
  }

  bool yes(std::string_view column) {
    const std::string_view field = value(column);
    if (field.empty()) return false;
    const std::optional<bool> yes = truth_of(field);
    if (!yes) add_fault(column, "expected 0, 1 (or TRUE, FALSE) or nothing");
    return yes.value_or(false);
  }

  void add_fault(std::string_view column, const std::string& expected) {
    if (faults_.size() >= kMostTaskFaults) return;
    faults_.push_back({file_, "line " + std::to_string(reader_.line()) + ", " + std::string(column),
                       expected + ", found '" + shortened(printable(text(column)), 40) + "'"});
  }
  /// For a column that the whole table lacks: one fault, however many rows need it.
  void add_header_fault(const std::string& expected) {
    for (const protocols::Fault& fault : faults_) {
      if (fault.expected == expected) return;
    }
    faults_.push_back({file_, "line 1", expected});
  }

 private:
  const std::string& file_;
  const Columns& columns_;
  const CsvReader& reader_;
  std::vector<protocols::Fault>& faults_;
};

/// Derives success for data of other programs without such a column. \return false: not possible
bool success_of(TaskRow& row, StudyTrial& trial) {
  const bool known = row.has("correct");
  if (trial.task == "identify") {
    trial.success = trial.response == base_name(trial.shape);
  } else if (trial.task == "detect") {
    trial.success = trial.response == "yes";
  } else if (trial.response == "same" || trial.response == "different") {
    trial.success = trial.response == "different";
  } else if (trial.task == "compare" && row.has("comparison_interval")) {
    trial.success = trial.response == row.value("comparison_interval");
  } else if (trial.task == "compare") {
    return false;
  }
  if (!known && trial.task == "identify") trial.correct = trial.success;
  if (!known && trial.task == "detect") trial.correct = trial.success != trial.catch_trial;
  return true;
}

/// Ratings of other programs have their number as the response.
void take_rated_number(StudyTrial& trial) {
  if (trial.task != "rate" || trial.number) return;
  const std::string& text = trial.response;
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (whole && std::isfinite(number)) trial.number = number;
}

/// For an export: the number of onsets.
int intervals_of(const TaskRow& row) {
  const std::string_view onsets = row.value("interval_onsets");
  if (onsets.empty()) return 0;
  return static_cast<int>(std::count(onsets.begin(), onsets.end(), ';')) + 1;
}

/// The columns of factors: those that the protocols name, wherever they stand; without a protocol
/// those after `practice` that have no other meaning.
std::vector<std::string> factor_columns(const Columns& columns,
                                        const std::vector<ProtocolText>& protocols) {
  std::vector<std::string> named;
  for (const ProtocolText& one : protocols) {
    for (const data::StoredFactor& factor : data::read_stored_protocol(one.text).factors) {
      if (columns.contains(factor.name)) note_once(factor.name, named);
    }
  }
  if (!named.empty()) return named;
  const auto practice = columns.find("practice");
  if (practice == columns.end()) return {};
  std::map<std::size_t, std::string> after;
  for (const auto& [name, place] : columns) {
    if (place > practice->second) after.emplace(place, name);
  }
  std::vector<std::string> out;
  for (const auto& [place, name] : after) {
    if (name == "timed_out" || name == "onset_utc") return out;
    if (!is_column_name(name)) out.push_back(name);
  }
  return {};
}

/// Tells of columns that may be factors, where none is known: trials of their levels are pooled.
void warn_of_unread(const std::vector<std::string>& found, const std::vector<std::string>& factors,
                    const std::vector<AlikeColumn>& alike, StudyTable& table) {
  if (!factors.empty()) return;
  std::vector<std::string> unread;
  for (const std::string& name : found) {
    if (!is_column_name(name) && std::ranges::find(alike, name, &AlikeColumn::found) == alike.end())
      unread.push_back("'" + printable(name, 40) + "'");
  }
  constexpr std::size_t kMost = 10;
  if (unread.empty()) return;
  const std::size_t more = unread.size() - std::min(unread.size(), kMost);
  unread.resize(std::min(unread.size(), kMost));
  if (more > 0) unread.push_back(std::to_string(more) + " more");
  table.warnings.push_back(
      "Not read: " + joined(unread) +
      ". Columns of factors stand between practice and timed_out, or are "
      "named by the protocol (--design), which also names those of levels of several "
      "dimensions.");
}

/// The measures of a movement; none: another task.
std::optional<data::ReachRecord> read_reach(TaskRow& row) {
  if (row.value("task") != "reach") return std::nullopt;
  data::ReachRecord reach;
  reach.kind = row.value("reach_kind");
  reach.duration = row.number("movement_duration");
  reach.peak_speed = row.number("peak_speed");
  reach.deviation = row.number("deviation");
  reach.largest_deviation = row.number("largest_deviation");
  reach.path_ratio = row.number("path_ratio");
  reach.endpoint_error = row.number("endpoint_error");
  reach.side_force = row.number("side_force");
  reach.adaptation = row.number("adaptation");
  return reach;
}

/// The dimensions of a block's level, by its name; those of several protocols follow each other.
using BlockDimensions = std::map<std::string, std::vector<std::string>>;

BlockDimensions dimensions_of(const std::vector<ProtocolText>& protocols) {
  BlockDimensions out;
  for (const ProtocolText& one : protocols) {
    for (const data::StoredBlock& block : data::read_stored_protocol(one.text).blocks) {
      for (const std::string& name : block.dimensions) note_once(name, out[block.name]);
    }
  }
  return out;
}

StudyTrial read_trial(TaskRow& row, const std::vector<std::string>& factors,
                      const BlockDimensions& dimensions) {
  StudyTrial trial;
  trial.participant = row.text("participant_id");
  trial.task = row.value("task");
  if (trial.task.empty()) trial.task = "identify";  // of a study of version 1
  trial.block_name = row.text("block_name");
  trial.track = row.text("track");
  trial.renderer = row.text("renderer");
  CellName cell{std::string(row.text("shape"))};
  for (const std::string& factor : factors) {
    if (!row.value(factor).empty()) cell.levels.emplace_back(factor, row.value(factor));
  }
  trial.shape = cell.text();
  trial.response = trial.task == "identify" ? row.text("response") : row.value("response");
  trial.level = row.number("level");
  trial.standard_level = row.number("standard_level");
  if (const auto own = dimensions.find(trial.block_name); own != dimensions.end()) {
    for (const std::string& name : own->second) {
      if (!row.has(name.c_str())) continue;
      if (const auto value = row.number(name.c_str())) trial.dimensions.emplace_back(name, *value);
    }
  }
  trial.number = row.number("number");
  take_rated_number(trial);
  trial.confidence = row.number("confidence");
  trial.reach = read_reach(row);
  trial.catch_trial = row.yes("catch_trial");
  trial.success = row.yes("success");
  if (!row.value("correct").empty()) trial.correct = row.yes("correct");
  trial.timed_out = row.yes("timed_out");
  trial.answered = !trial.timed_out && (!trial.response.empty() || trial.number);
  trial.session = row.whole("session");
  trial.block = row.whole("block");
  trial.trial = row.whole("trial");
  trial.response_time = row.number("response_time");
  if (trial.response_time && *trial.response_time < 0)
    row.add_fault("response_time", "expected a time in s, 0 or more");
  trial.intervals = intervals_of(row);
  trial.protocol_sha256 = row.value("protocol_sha256");
  if (!row.has("success") && !success_of(row, trial))
    row.add_header_fault(
        "expected a column success (1: the comparison was chosen), or comparison_interval" +
        row.hint("success") + row.hint("comparison_interval"));
  if (trial.participant.empty()) row.add_fault("participant_id", "expected a participant");
  if (std::find(std::begin(kTasks), std::end(kTasks), trial.task) == std::end(kTasks))
    row.add_fault("task", "expected identify, compare, detect, rate, adjust, external or reach");
  return trial;
}

/// Sorts the trials of each track within its own positions.
void order_trials(std::vector<StudyTrial>& trials) {
  using Track =
      std::tuple<std::string, std::string, std::string, std::string, std::string, std::string>;
  std::map<Track, std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const StudyTrial& one = trials[i];
    places[{one.participant, one.task, one.block_name, one.renderer, one.shape, one.track}]
        .push_back(i);
  }
  const auto number = [](const StudyTrial& one) {
    return std::tuple(one.session, one.block, one.trial);
  };
  for (const auto& [track, own] : places) {
    std::vector<StudyTrial> ordered;
    ordered.reserve(own.size());
    for (const std::size_t i : own) ordered.push_back(std::move(trials[i]));
    std::ranges::stable_sort(ordered, {}, number);
    for (std::size_t i = 0; i < own.size(); ++i) trials[own[i]] = std::move(ordered[i]);
  }
}

/// "NA" is no answer unless a stimulus has that name.
void drop_missing_answers(std::vector<StudyTrial>& trials) {
  std::set<std::string> shapes;
  for (const StudyTrial& trial : trials) shapes.insert(base_name(trial.shape));
  for (StudyTrial& trial : trials) {
    if (trial.task != "identify" || !is_missing(trial.response) || shapes.contains(trial.response))
      continue;
    trial.response.clear();
    trial.answered = false;
  }
}

/// Adds factors with their levels, each once.
void note_factors(const std::vector<data::StoredFactor>& more, StudyTable& table) {
  for (const data::StoredFactor& factor : more) {
    StudyFactor* known = nullptr;
    for (StudyFactor& one : table.factors) {
      if (one.name == factor.name) known = &one;
    }
    if (known == nullptr) known = &table.factors.emplace_back(StudyFactor{factor.name, {}});
    for (const auto& [level, sets] : factor.levels) note_once(level, known->levels);
  }
}

/// Adds the factors of the trials that no protocol described, levels by name.
void note_factors_of_trials(StudyTable& table) {
  std::vector<data::StoredFactor> found;
  std::set<std::pair<std::string, std::string>> levels;
  for (const StudyTrial& trial : table.trials) {
    for (const auto& one : cell_name(trial.shape).levels) levels.insert(one);
    for (const auto& [factor, level] : cell_name(trial.shape).levels) {
      if (std::ranges::find(found, factor, &data::StoredFactor::name) == found.end())
        found.push_back({factor, {}});
    }
  }
  for (data::StoredFactor& factor : found) {
    for (const auto& [name, level] : levels) {
      if (name == factor.name) factor.levels.emplace_back(level, "");
    }
  }
  note_factors(found, table);
}

/// The protocol of a group, by its SHA-256 and the group's name; "": without groups.
std::string procedures_key(const std::string& protocol_sha256, const std::string& group) {
  return group.empty() ? protocol_sha256 : protocol_sha256 + "/" + group;
}

/// Adds the procedures of a protocol, for each of its groups; of masked ones by both names.
void add_procedures(const std::string& sha256, const std::string& text, const std::string& path,
                    StudyTable& table) {
  const GroupAssignment masked = data::read_stored_protocol(text).groups;
  const GroupAssignment groups = masked.unmasked();
  for (const auto& [group, patched] : protocols::texts_of_groups(text)) {
    const auto& found = table.procedures[procedures_key(sha256, group)] =
        protocols::procedures_of_blocks(patched, path);
    if (masked.masked())
      table.procedures[procedures_key(sha256, masked.names[groups.find(group)])] = found;
  }
}

/// Sets the groups of the participants from the trials, and what there is to say of them.
/// \param names  the groups in the protocol's order; others follow as they come
void label_groups(const std::vector<std::string>& names, StudyTable& table) {
  GroupLabels& labels = table.group_labels;
  const std::vector<std::string> came = std::exchange(labels, {}).names;
  labels.names = names;
  for (const std::string& name : came) note_once(name, labels.names);
  Interner without;
  for (const StudyTrial& trial : table.trials) {
    if (trial.group.empty())
      without.number(trial.participant);
    else
      labels.add(trial.participant, trial.group);
  }
  if (labels.of.empty()) {
    labels.names.clear();
    return;
  }
  Interner all;
  for (const std::string& name : labels.names) all.number(name);
  warn_of_alike("Groups", all.names(), table.warnings);
  if (without.names().empty()) return;
  std::string text;
  for (const std::string& name : without.names()) text += (text.empty() ? "" : ", ") + name;
  table.warnings.push_back("Without a group, and left out of the comparison of groups: " + text +
                           ".");
}

/// The names of a protocol's groups, masked unless a trial has one that is not.
std::vector<std::string> names_in(const StudyTable& table, const GroupAssignment& groups) {
  const bool named = std::ranges::any_of(table.trials, [&](const StudyTrial& trial) {
    return std::ranges::find(groups.true_names, trial.group) != groups.true_names.end();
  });
  return (named ? groups.unmasked() : groups).listed();
}

void warn_of_alike_names(StudyTable& table) {
  Interner participants, renderers, shapes;
  for (const StudyTrial& trial : table.trials) {
    participants.number(trial.participant);
    renderers.number(trial.renderer);
    shapes.number(trial.shape);
  }
  warn_of_alike("Participants", participants.names(), table.warnings);
  warn_of_alike("Renderers", renderers.names(), table.warnings);
  warn_of_alike("Stimuli", shapes.names(), table.warnings);
}

Simulated simulated_in(const std::vector<StudyTrial>& trials) {
  const auto n = static_cast<std::size_t>(std::ranges::count(trials, true, &StudyTrial::simulated));
  if (n == 0) return Simulated::no;
  return n == trials.size() ? Simulated::yes : Simulated::mixed;
}

bool is_wanted(const std::vector<std::string>& wanted, std::string_view name,
               std::string_view sha256) {
  return wanted.empty() || std::ranges::any_of(wanted, [&](const std::string& one) {
           return is_protocol(one, name, sha256);
         });
}

/// Whether the rows of a file are of tasks; it may have others, too.
bool is_of_tasks(const std::string& path, const std::vector<std::string>& wanted) try {
  CsvReader reader(path);
  const Columns columns = read_header(reader);
  if (!columns.contains("task")) return false;
  std::vector<protocols::Fault> faults;
  bool has_others = false;
  while (reader.next()) {
    const TaskRow row(path, columns, reader, faults);
    if (!is_wanted(wanted, row.value("protocol_name"), row.value("protocol_sha256"))) continue;
    if (!row.value("task").empty()) return true;
    has_others = true;
  }
  return !has_others;
} catch (const std::runtime_error&) {
  return false;  // read_trials_csv says what is wrong
}

StudyTable read_tasks_csv(const std::string& path, const std::vector<std::string>& wanted,
                          const std::vector<ProtocolText>& protocols) {
  StudyTable table;
  table.source = table.provenance.source = path;
  std::vector<protocols::Fault> faults;
  CsvReader reader(path);
  std::vector<std::string> found, twice;
  const Columns columns = read_header(reader, &twice);
  const std::vector<std::string> factors = factor_columns(columns, protocols);
  const BlockDimensions dimensions = dimensions_of(protocols);
  const std::size_t n_fields = reader.fields().size();
  faults.reserve(twice.size());
  for (const std::string& name : twice)
    faults.push_back({path, "line 1", "expected each column once; " + name + " comes again"});
  for (const auto& column : columns) {
    const std::string& name = column.first;
    const bool read = std::ranges::any_of(dimensions, [&](const auto& block) {
      return std::ranges::find(block.second, name) != block.second.end();
    });
    if (!read) found.push_back(name);
  }
  const std::vector<AlikeColumn> alike = alike_columns(found, kTaskColumns);
  for (const char* needed : {"participant_id", "task", "renderer", "shape", "response"}) {
    if (columns.count(needed) == 0)
      faults.push_back(
          {path, "line 1", std::string("expected a column ") + needed + hint_for(needed, alike)});
  }
  for (const AlikeColumn& one : alike) table.warnings.push_back(sentence(one));
  warn_of_unread(found, factors, alike, table);
  TorqueCounts torque;
  const bool numbered = columns.count("session") > 0 && columns.count("trial") > 0;
  std::map<std::tuple<std::string, std::pair<std::string, std::string>, int, int, int>, std::size_t>
      seen;  // line of each trial
  while (faults.size() < kMostTaskFaults && reader.next()) {
    TaskRow row(path, columns, reader, faults);
    if (!reader.fault().empty()) {
      faults.push_back({path, "line " + std::to_string(reader.line()), reader.fault()});
      continue;
    }
    if (reader.fields().size() != n_fields) {
      faults.push_back({path, "line " + std::to_string(reader.line()),
                        "expected " + std::to_string(n_fields) +
                            " fields, as in the header; found " +
                            std::to_string(reader.fields().size())});
      continue;
    }
    std::pair named(std::string(row.value("protocol_name")),
                    std::string(row.value("protocol_sha256")));
    const auto stated = std::ranges::find(protocols, named.second, &ProtocolText::sha256);
    if (stated != protocols.end()) named.first = stated->name;
    if (!is_wanted(wanted, named.first, named.second)) continue;
    const bool simulated = row.yes("simulated");
    table.simulated |= simulated;
    if (row.yes("practice")) {
      ++table.n_practice;
      continue;
    }
    table.trials.push_back(read_trial(row, factors, dimensions));
    StudyTrial& trial = table.trials.back();
    trial.simulated = simulated;
    if (!row.value("group").empty()) {
      trial.group = row.text("group");
      const std::string& known = table.group_labels.add(trial.participant, trial.group);
      if (known != trial.group)
        row.add_fault("group", "expected one group for each participant; found " +
                                   printable(known) + " before");
    }
    if (!protocols.empty()) trial.participant_number = row.whole("participant_number");
    note_shown(trial.protocol_sha256, table.provenance.protocol_sha256);
    note_shown(row.value("program_version"), table.provenance.program_versions);
    if (!row.value("torque_driven").empty()) torque.add(trial.renderer, row.yes("torque_driven"));
    if (std::find(table.protocols.begin(), table.protocols.end(), named) == table.protocols.end())
      table.protocols.push_back(named);
    const auto [first, is_new] =
        seen.emplace(std::tuple(trial.participant, named, trial.session, trial.block, trial.trial),
                     reader.line());
    if (numbered && !is_new)
      row.add_fault("trial", "expected each trial once: it is in line " +
                                 std::to_string(first->second) + ", too");
  }
  if (faults.empty() && !reader.fault().empty())
    faults.push_back({path, "line " + std::to_string(reader.line()), reader.fault()});
  if (faults.empty() && table.trials.empty())
    faults.push_back({path, "line 1",
                      "expected at least one trial that is not practice" +
                          (wanted.empty() ? "" : " of the protocol " + wanted.front())});
  if (!faults.empty()) throw protocols::InputError(std::move(faults));
  put_protocols(protocols, path, table);
  if (numbered) order_trials(table.trials);
  drop_missing_answers(table.trials);
  table.of_trials = simulated_in(table.trials);
  warn_of_alike_names(table);
  torque.warn(table.warnings);
  return table;
}

std::optional<TrialTable> times_of_trials(const StudyTable& table) {
  TrialTableBuilder builder;
  std::size_t n = 0;
  for (const StudyTrial& trial : table.trials) {
    if (trial.task != "identify" || trial.level) continue;
    if (!trial.response_time && !trial.timed_out) return std::nullopt;
    builder.add(trial);
    ++n;
  }
  if (n == 0) return std::nullopt;
  try {
    return builder.finish(table.provenance);
  } catch (const std::runtime_error&) {  // duplicate rows, without trial numbers
    return std::nullopt;
  }
}

StudyTable read_tasks_store(data::Store& store, const std::string& protocol) {
  const std::string& path = store.path();
  StudyTable table;
  table.source = table.provenance.source = path;
  std::vector<std::string> names, observers;
  const data::TorqueNotes torque_notes(store);
  const data::ParticipantGroups groups(store);
  TorqueCounts torque;
  const auto visit = [&](const data::StoredTrial& stored) {
    if (!is_protocol(protocol, stored.protocol_name, stored.protocol_sha256)) return;
    const std::pair known(stored.protocol_name, stored.protocol_sha256);
    if (std::find(table.protocols.begin(), table.protocols.end(), known) == table.protocols.end())
      table.protocols.push_back(known);
    table.simulated |= stored.participant.simulated;
    if (stored.record.practice) {
      ++table.n_practice;
    } else {
      table.trials.push_back(study_trial_of(stored.participant.code, stored.record));
      table.trials.back().protocol_sha256 = stored.protocol_sha256;
      table.trials.back().participant_number = stored.participant.enrolled_number;
      table.trials.back().simulated = stored.participant.simulated;
      table.trials.back().group = groups.of(stored.participant, stored.protocol_sha256);
      torque.add(stored.record.renderer, torque_notes.driven(stored));
      note_once(stored.protocol_name, names);
      note_once(stored.protocol_sha256, table.provenance.protocol_sha256);
      note_once(stored.run.program_version, table.provenance.program_versions);
      note_once(stored.run.observer_sha256, observers);
    }
  };
  const std::function<bool(const data::StoredTrial&)> has_path =
      [](const data::StoredTrial& stored) { return stored.record.task.reach.has_value(); };
  store.for_each_trial(visit, has_path);
  std::vector<ProtocolText> protocols;
  for (const data::ProtocolInfo& one : store.protocols()) {
    if (is_protocol(protocol, one.name, one.sha256))
      protocols.push_back({one.name, one.sha256, one.text, "", ""});
  }
  put_protocols(protocols, path, table);
  if (groups.masked() && !table.group_labels.of.empty())
    table.warnings.emplace_back(
        "The groups are masked: letters stand for their names until 'palpate unmask'.");
  table.people = data::participant_columns(store);
  std::set<std::string> shown;
  for (const StudyTrial& trial : table.trials) shown.insert(trial.participant);
  for (data::ParticipantColumn& column : table.people)
    std::erase_if(column.answers, [&](const auto& one) { return !shown.contains(one.first); });
  table.provenance.protocol_name = listed(names);
  table.provenance.observer_sha256 = listed(observers);
  if (table.trials.empty())
    throw protocols::InputError(
        {{path, "trials",
          "expected at least one completed trial that is not practice" +
              (protocol.empty() ? "" : " of the protocol " + printable(protocol))}});
  table.of_trials = simulated_in(table.trials);
  warn_of_alike_names(table);
  torque.warn(table.warnings);
  return table;
}

/// A study of shapes: its times, with the shapes in the order of its protocols.
StudyTable of_shapes(TrialTable times, const std::string& source,
                     const std::vector<ProtocolText>& protocols) {
  StudyTable table;
  std::vector<std::string> order;
  for (const ProtocolText& one : protocols) {
    for (const std::string& name : data::read_stored_protocol(one.text).stimuli)
      note_once(name, order);
  }
  order_shapes(times, order);
  table.source = source;
  table.simulated = times.simulated != Simulated::no;
  table.of_trials = times.simulated;
  table.provenance = times.provenance;
  table.times = std::move(times);
  return table;
}

/// Some kPlaces places of the tip.
std::vector<Vec3> path_of(const data::TrialRecord& record) {
  constexpr std::size_t kPlaces = 80;
  std::vector<Vec3> path;
  const std::size_t every = std::max<std::size_t>(1, record.samples.size() / kPlaces);
  for (std::size_t i = 0; i < record.samples.size(); i += every) {
    const auto& tip = record.samples[i].tip;
    path.emplace_back(tip[0], tip[1], tip[2]);
  }
  return path;
}

}  // namespace

const std::string& GroupLabels::add(const std::string& participant, const std::string& group) {
  auto at = std::ranges::find(names, group);
  if (at == names.end()) at = names.insert(names.end(), group);
  return names[of.emplace(participant, static_cast<std::size_t>(at - names.begin())).first->second];
}

const protocols::BlockProcedures* block_of(const StudyTrial& trial, const StudyTable& table) {
  const auto protocol = table.procedures.find(procedures_key(trial.protocol_sha256, trial.group));
  if (protocol == table.procedures.end()) return nullptr;
  const auto block = protocol->second.find(trial.block_name);
  return block == protocol->second.end() ? nullptr : &block->second;
}

void put_protocols(const std::vector<ProtocolText>& protocols, const std::string& path,
                   StudyTable& table) {
  std::vector<std::string> groups;
  for (const ProtocolText& one : protocols) {
    add_procedures(one.sha256, one.text, path, table);
    const data::StoredProtocol stored = data::read_stored_protocol(one.text);
    const bool used = std::ranges::any_of(
        table.protocols, [&](const auto& known) { return known.second == one.sha256; });
    if (used && table.title.empty()) table.title = stored.title;
    for (const std::string& name : names_in(table, stored.groups)) note_once(name, groups);
    note_factors(stored.factors, table);
    for (const std::string& effect : stored.tests) note_once(effect, table.tests);
  }
  label_groups(groups, table);
  note_factors_of_trials(table);
  for (StudyTrial& trial : table.trials) {
    const protocols::BlockProcedures* const block = block_of(trial, table);
    if (block != nullptr && block->cells_share_tracks) trial.shape = base_name(trial.shape);
  }
}

StudyTrial study_trial_of(const std::string& participant, const data::TrialRecord& record) {
  StudyTrial trial;
  trial.participant = participant;
  trial.renderer = record.renderer;
  trial.shape = record.shape;
  trial.response = record.response;
  if (data::has_right_answer(record)) trial.correct = record.correct;
  trial.task = record.task.task;
  trial.block_name = record.task.block_name;
  trial.track = std::to_string(record.task.track);
  trial.level = record.task.level;
  trial.standard_level = record.task.standard_level;
  trial.dimensions = record.task.dimensions;
  trial.number = record.task.number;
  trial.confidence = record.task.confidence;
  trial.reach = record.task.reach;
  if (trial.reach) trial.path = path_of(record);
  trial.catch_trial = record.task.catch_trial;
  trial.success = record.task.success;
  trial.intervals = static_cast<int>(record.task.intervals.size());
  trial.answered = !record.timed_out && (!trial.response.empty() || trial.number);
  trial.session = record.session;
  trial.block = record.block;
  trial.trial = record.trial;
  trial.timed_out = record.timed_out;
  trial.response_time = record.response_time;
  return trial;
}

StudyTable read_study_csv(const std::string& path, const std::vector<std::string>& wanted,
                          const std::vector<ProtocolText>& protocols) {
  if (!is_of_tasks(path, wanted)) {
    StudyTable table = of_shapes(read_trials_csv(path, wanted), path, protocols);
    CsvReader reader(path);
    if (read_header(reader).contains("group"))
      table.times->warnings.emplace_back(
          "The column group is not used without a column task; add one, with identify in each "
          "row, to compare the groups.");
    return table;
  }
  return read_tasks_csv(path, wanted, protocols);
}

StudyTable read_study_store(data::Store& store, const std::string& protocol) {
  std::vector<std::string> wanted;
  for (const data::ProtocolInfo& one : store.protocols()) {
    if (is_protocol(protocol, one.name, one.sha256)) wanted.push_back(one.text);
  }
  if (!data::have_blocks(wanted))
    return of_shapes(read_trials_store(store, protocol), store.path(), {});
  return read_tasks_store(store, protocol);
}

void identify_times(StudyTable& table) {
  if (!table.times) table.times = times_of_trials(table);
}

}  // namespace palpate::analysis
