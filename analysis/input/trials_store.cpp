#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/input/torque_counts.h"
#include "analysis/input/trial_table_builder.h"
#include "analysis/input/trials.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "data/store/store.h"
#include "data/store/torque_notes.h"
#include "protocols/parse.h"

namespace palpate::analysis {

namespace {

/// Names of the stimuli in the order of a stored protocol. Not validated again: it was when it was
/// stored, and mesh files that it names may be missing now.
std::vector<std::string> stimuli_of(const std::string& protocol_text) {
  std::vector<std::string> names;
  const auto json = data::json_or_discarded(protocol_text);
  if (!json.is_object() || !json.contains("stimuli") || !json["stimuli"].is_array()) return names;
  for (const auto& stimulus : json["stimuli"]) {
    if (stimulus.is_object() && stimulus.contains("name") && stimulus["name"].is_string()) {
      names.push_back(stimulus["name"].get<std::string>());
    }
  }
  return names;
}

void note(const std::string& value, std::vector<std::string>& known) {
  if (!value.empty() && std::find(known.begin(), known.end(), value) == known.end()) {
    known.push_back(value);
  }
}

}  // namespace

TrialTable read_trials_store(const std::string& path) {
  data::Store store = data::Store::open(path, data::Store::Mode::read_only);
  Provenance provenance;
  provenance.source = path;
  std::vector<std::string> listed, protocol_names, observers;
  for (const data::ProtocolInfo& protocol : store.protocols()) {
    for (const std::string& name : stimuli_of(protocol.text)) note(name, listed);
  }
  TrialTableBuilder builder;
  const data::TorqueNotes notes(store);
  TorqueCounts torque;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    const data::TrialRecord& record = trial.record;
    if (record.renderer != "point" && record.renderer != "ray") {
      throw protocols::InputError({{path, "participant " + trial.participant.code,
                                    "expected the renderer 'point' or 'ray'; found '" +
                                        stimuli::printable(record.renderer, 40) + "'"}});
    }
    RawTrial raw;
    raw.participant = trial.participant.code;
    raw.renderer = record.renderer;
    raw.shape = record.shape;
    raw.response = record.response;
    raw.session = record.session;
    raw.block = record.block;
    raw.trial = record.trial;
    raw.correct = record.correct;
    raw.practice = record.practice;
    raw.timed_out = record.timed_out;
    raw.simulated = trial.participant.simulated;
    raw.response_time = record.response_time;
    builder.add(raw);
    if (!record.practice) torque.add(record.renderer, notes.driven(trial));
    note(trial.protocol_name, protocol_names);
    note(trial.protocol_sha256, provenance.protocol_sha256);
    note(trial.run.program_version, provenance.program_versions);
    note(trial.run.observer_sha256, observers);
  });
  const auto join = [](const std::vector<std::string>& parts) {
    std::string all;
    for (const auto& part : parts) all += (all.empty() ? "" : ", ") + part;
    return all;
  };
  provenance.protocol_name = join(protocol_names);
  provenance.observer_sha256 = join(observers);
  try {
    TrialTable table = builder.finish(std::move(provenance), listed);
    torque.warn(table.warnings);
    return table;
  } catch (const std::runtime_error& error) {
    throw protocols::InputError({{path, "trials", error.what()}});
  }
}

}  // namespace palpate::analysis
