#include "analysis/input/task_trials.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string_view>

#include "analysis/input/csv_reader.h"
#include "analysis/input/trial_table_builder.h"
#include "analysis/text.h"
#include "protocols/parse.h"

namespace palpate::analysis {
namespace {

using Columns = std::map<std::string, std::size_t, std::less<>>;
constexpr std::size_t kMostTaskFaults = 50;
const char* const kTasks[] = {"identify", "compare", "detect", "rate", "adjust"};

Columns read_header(CsvReader& reader) {
  Columns columns;
  if (!reader.next()) return columns;
  for (std::size_t i = 0; i < reader.fields().size(); ++i)
    columns.emplace(std::string(reader.fields()[i]), i);
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
    const std::string_view field = reader_.fields()[place->second];
    return field == "NA" || field == "n/a" ? std::string_view() : field;
  }

  std::optional<double> number(std::string_view column) {
    const std::string_view field = text(column);
    if (field.empty()) return std::nullopt;
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error == std::errc() && end == field.data() + field.size() && std::isfinite(value))
      return value;
    add_fault(column, "expected a number or nothing");
    return std::nullopt;
  }

  /// From 1; 1 where there is none.
  int whole(std::string_view column) {
    const std::string_view field = text(column);
    int value = 1;
    if (field.empty()) return value;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error == std::errc() && end == field.data() + field.size() && value >= 1) return value;
    add_fault(column, "expected a whole number from 1, or nothing");
    return 1;
  }

  bool yes(std::string_view column) {
    const std::string_view field = text(column);
    if (field.empty() || field == "0") return false;
    if (field != "1") add_fault(column, "expected 0, 1 or nothing");
    return field == "1";
  }

  void add_fault(std::string_view column, const std::string& expected) {
    if (faults_.size() >= kMostTaskFaults) return;
    faults_.push_back(
        {file_, "line " + std::to_string(reader_.line()) + ", " + std::string(column),
         expected + ", found '" + shortened(stimuli::printable(text(column)), 40) + "'"});
  }

 private:
  const std::string& file_;
  const Columns& columns_;
  const CsvReader& reader_;
  std::vector<protocols::Fault>& faults_;
};

TaskTrial read_trial(TaskRow& row) {
  TaskTrial trial;
  trial.participant = row.text("participant_id");
  trial.task = row.text("task");
  if (trial.task.empty()) trial.task = "identify";  // of a study of version 1
  trial.block_name = row.text("block_name");
  trial.track = row.text("track");
  trial.renderer = row.text("renderer");
  trial.shape = row.text("shape");
  trial.response = row.text("response");
  trial.level = row.number("level");
  trial.standard_level = row.number("standard_level");
  trial.number = row.number("number");
  trial.confidence = row.number("confidence");
  trial.catch_trial = row.yes("catch_trial");
  trial.success = row.yes("success");
  trial.correct = row.yes("correct");
  trial.timed_out = row.yes("timed_out");
  trial.answered = !trial.timed_out && (!trial.response.empty() || trial.number);
  trial.session = row.whole("session");
  trial.block = row.whole("block");
  trial.trial = row.whole("trial");
  trial.response_time = row.number("response_time");
  if (trial.response_time && *trial.response_time < 0)
    row.add_fault("response_time", "expected a time in s, 0 or more");
  if (trial.participant.empty()) row.add_fault("participant_id", "expected a participant");
  if (std::find(std::begin(kTasks), std::end(kTasks), trial.task) == std::end(kTasks))
    row.add_fault("task", "expected identify, compare, detect, rate or adjust");
  return trial;
}

}  // namespace

bool has_task_column(const std::string& path) {
  CsvReader reader(path);
  return read_header(reader).count("task") > 0;
}

TaskTable read_task_trials_csv(const std::string& path) {
  TaskTable table;
  table.source = table.provenance.source = path;
  std::vector<protocols::Fault> faults;
  CsvReader reader(path);
  const Columns columns = read_header(reader);
  for (const char* needed : {"participant_id", "task", "renderer", "shape", "response"}) {
    if (columns.count(needed) == 0)
      faults.push_back({path, "line 1", std::string("expected a column ") + needed});
  }
  while (faults.size() < kMostTaskFaults && reader.next()) {
    TaskRow row(path, columns, reader, faults);
    if (!reader.fault().empty()) {
      faults.push_back({path, "line " + std::to_string(reader.line()), reader.fault()});
      continue;
    }
    const bool simulated = row.yes("simulated");
    table.simulated |= simulated;
    if (row.yes("practice")) {
      ++table.n_practice;
    } else {
      table.trials.push_back(read_trial(row));
      table.trials.back().simulated = simulated;
    }
  }
  if (faults.empty() && !reader.fault().empty())
    faults.push_back({path, "line " + std::to_string(reader.line()), reader.fault()});
  if (faults.empty() && table.trials.empty())
    faults.push_back({path, "line 1", "expected at least one trial that is not practice"});
  if (!faults.empty()) throw protocols::InputError(std::move(faults));
  return table;
}

std::optional<TrialTable> identification_of(const TaskTable& table) {
  TrialTableBuilder builder;
  std::size_t n = 0;
  for (const TaskTrial& trial : table.trials) {
    if (trial.task != "identify" || trial.level) continue;
    if (!trial.response_time && !trial.timed_out) return std::nullopt;
    RawTrial raw;
    raw.participant = trial.participant;
    raw.renderer = trial.renderer;
    raw.shape = trial.shape;
    raw.response = trial.response;
    raw.session = trial.session;
    raw.block = trial.block;
    raw.trial = trial.trial;
    raw.correct = trial.correct;
    raw.timed_out = trial.timed_out;
    raw.simulated = trial.simulated;
    raw.response_time = trial.response_time.value_or(kNoTime);
    builder.add(raw);
    ++n;
  }
  if (n == 0) return std::nullopt;
  try {
    return builder.finish(table.provenance);
  } catch (const std::runtime_error&) {  // rows that are there twice, without numbers
    return std::nullopt;
  }
}

}  // namespace palpate::analysis
