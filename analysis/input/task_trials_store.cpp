#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "analysis/input/study_record.h"
#include "analysis/input/task_trials.h"
#include "analysis/input/torque_counts.h"
#include "data/base/json_text.h"
#include "data/store/store.h"
#include "data/store/torque_notes.h"
#include "protocols/parse.h"
#include "stimuli/text.h"

namespace palpate::analysis {
namespace {

std::string listed(const std::vector<std::string>& parts) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : ", ") + part;
  return all;
}

void note_once(const std::string& value, std::vector<std::string>& known) {
  if (!value.empty() && std::find(known.begin(), known.end(), value) == known.end())
    known.push_back(value);
}

}  // namespace

bool has_tasks(const std::string& database) {
  data::Store store = data::Store::open(database, data::Store::Mode::read_only);
  for (const data::ProtocolInfo& protocol : store.protocols()) {
    const auto json = data::json_or_discarded(protocol.text);
    if (json.is_object() && json.contains("version") && json["version"] == 2) return true;
  }
  return false;
}

TaskTrial task_trial_of(const std::string& participant, const data::TrialRecord& record) {
  TaskTrial trial;
  trial.participant = participant;
  trial.task = "identify";  // of a study of version 1
  trial.renderer = record.renderer;
  trial.shape = record.shape;
  trial.response = record.response;
  if (data::has_right_answer(record)) trial.correct = record.correct;
  if (record.task) {
    trial.task = record.task->task;
    trial.block_name = record.task->block_name;
    trial.track = std::to_string(record.task->track);
    trial.level = record.task->level;
    trial.standard_level = record.task->standard_level;
    trial.number = record.task->number;
    trial.confidence = record.task->confidence;
    trial.catch_trial = record.task->catch_trial;
    trial.success = record.task->success;
    trial.intervals = static_cast<int>(record.task->intervals.size());
  }
  trial.answered = !record.timed_out && (!trial.response.empty() || trial.number);
  trial.session = record.session;
  trial.block = record.block;
  trial.trial = record.trial;
  trial.timed_out = record.timed_out;
  trial.response_time = record.response_time;
  return trial;
}

TaskTable read_task_trials_store(const std::string& path, const std::string& protocol) {
  data::Store store = data::Store::open(path, data::Store::Mode::read_only);
  TaskTable table;
  table.source = table.provenance.source = path;
  std::vector<std::string> names, observers;
  const data::TorqueNotes torque_notes(store);
  TorqueCounts torque;
  store.for_each_trial([&](const data::StoredTrial& stored) {
    if (!is_protocol(protocol, stored.protocol_name, stored.protocol_sha256)) return;
    const std::pair known(stored.protocol_name, stored.protocol_sha256);
    if (std::find(table.protocols.begin(), table.protocols.end(), known) == table.protocols.end())
      table.protocols.push_back(known);
    table.simulated |= stored.participant.simulated;
    if (stored.record.practice) {
      ++table.n_practice;
    } else {
      table.trials.push_back(task_trial_of(stored.participant.code, stored.record));
      table.trials.back().protocol_sha256 = stored.protocol_sha256;
      table.trials.back().participant_number = stored.participant.enrolled_number;
      table.trials.back().simulated = stored.participant.simulated;
      torque.add(stored.record.renderer, torque_notes.driven(stored));
      note_once(stored.protocol_name, names);
      note_once(stored.protocol_sha256, table.provenance.protocol_sha256);
      note_once(stored.run.program_version, table.provenance.program_versions);
      note_once(stored.run.observer_sha256, observers);
    }
  });
  for (const data::ProtocolInfo& one : store.protocols()) {
    if (is_protocol(protocol, one.name, one.sha256))
      table.procedures[one.sha256] = protocols::procedures_of_blocks(one.text, path);
    const bool used = std::ranges::any_of(
        table.protocols, [&](const auto& known) { return known.second == one.sha256; });
    if (used && table.title.empty()) table.title = title_of_protocol(one.text);
  }
  table.provenance.protocol_name = listed(names);
  table.provenance.observer_sha256 = listed(observers);
  if (table.trials.empty())
    throw protocols::InputError(
        {{path, "trials",
          "expected at least one completed trial that is not practice" +
              (protocol.empty() ? "" : " of the protocol " + stimuli::printable(protocol))}});
  torque.warn(table.warnings);
  return table;
}

}  // namespace palpate::analysis
