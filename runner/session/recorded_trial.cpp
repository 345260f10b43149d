#include "runner/session/recorded_trial.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "protocols/groups.h"
#include "protocols/parse.h"
#include "protocols/session_plan.h"
#include "runner/session/device_check.h"
#include "runner/session/run_record.h"

namespace palpate::runner::session {
namespace {

/// Whether the protocol matches by name or by the first digits of its SHA-256.
bool is_named(const data::StoredTrial& trial, const std::string& protocol) {
  constexpr std::size_t kDigits = 6;
  return protocol.empty() || trial.protocol_name == protocol ||
         (protocol.size() >= kDigits && trial.protocol_sha256.starts_with(protocol));
}

/// Names the trials on record in place of a missing one: "; of P03 there are 1/1 to 1/304".
/// \param protocol  the one that is wanted
std::string what_there_is(data::Store& store, const data::TrialName& name,
                          const std::string& protocol) {
  constexpr std::size_t kMostNamed = 8;
  std::map<int, std::pair<int, int>> trials;  // the first and the last of each session
  std::set<std::string> codes;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (!is_named(trial, protocol)) return;
    codes.insert(trial.participant.code);
    if (trial.participant.code != name.code) return;
    const int number = trial.record.trial;
    auto& [first, last] = trials.try_emplace(trial.record.session, number, number).first->second;
    first = std::min(first, number);
    last = std::max(last, number);
  });
  if (codes.empty()) return "; it has no finished trial";
  std::string text;
  if (trials.empty()) {
    std::size_t named = 0;
    for (const std::string& code : codes) {
      if (named++ == kMostNamed) return "; finished trials are of" + text + " and others";
      text += (text.empty() ? " " : ", ") + code;
    }
    return "; finished trials are of" + text;
  }
  for (const auto& [session, range] : trials) {
    text += (text.empty() ? " " : ", ") + to_string({name.code, session, range.first});
    if (range.second > range.first) text += " to " + std::to_string(range.second);
  }
  return "; there are" + text;
}

data::StoredTrial find_trial(data::Store& store, const data::TrialName& name,
                             const std::string& protocol) {
  std::optional<data::StoredTrial> found;
  bool cut_off = false;
  std::string protocols;
  for (data::StoredTrial& trial : store.attempts(name)) {
    if (!is_named(trial, protocol)) continue;
    if (!trial.cut_off_reason.empty()) {
      cut_off = true;
      continue;
    }
    protocols += (protocols.empty() ? "" : ", ") + trial.protocol_name + " " +
                 trial.protocol_sha256.substr(0, 12);
    if (found) {
      throw data::StoreRefused(
          "--trial " + to_string(name) + ": there is one in each of several protocols (" +
          protocols + "); say which with --protocol and its name or the beginning of its checksum");
    }
    found = std::move(trial);
  }
  const std::string place = store.path() + ": " + to_string(name);
  if (!found) {
    throw data::StoreRefused(
        place + (cut_off
                     ? " was cut off before an answer: nothing of it was kept to replay"
                     : " is not on record" + (protocol.empty() ? "" : " in protocol " + protocol) +
                           what_there_is(store, name, protocol)));
  }
  if (found->record.samples.empty()) {
    throw data::StoreRefused(place +
                             " was recorded without servo samples; a protocol with \"samples\": "
                             "true keeps them");
  }
  return std::move(*found);
}

/// The text that was shown, where a run used another text that differs in words only.
protocols::Protocol stored_protocol(data::Store& store, const data::StoredTrial& trial,
                                    const std::string& mesh_folder) {
  std::string text;
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.sha256 == trial.protocol_sha256) text = info.text;
  }
  protocols::StoredFiles files;
  for (data::ProtocolFile& file : store.files(trial.protocol_sha256))
    files.emplace(file.name, std::move(file.bytes));
  const std::filesystem::path place =
      std::filesystem::path(mesh_folder) / (trial.protocol_name + ".json");
  const protocols::Protocol all = protocols::parse_protocol_text(text, place.string(), files);
  return protocols::protocol_of(all, trial.participant.enrolled_number);
}

/// Scales the materials down to the limits of the device of the trial's run. True: there were any
/// limits.
bool limited_by_a_note(protocols::Protocol& protocol, data::Store& store,
                       const data::StoredTrial& trial) {
  for (const data::StoredNote& note : store.notes()) {
    const data::ClockStamp &noted = note.run_clock, &shown = trial.run.clock;
    if (note.participant.id != trial.participant.id || note.session != trial.record.session ||
        noted.utc_ns != shown.utc_ns || noted.monotonic_ns != shown.monotonic_ns) {
      continue;
    }
    try {
      // A simulated session that was resumed repeats the same event.
      if (session::limit_as_recorded(protocol, note.text)) return true;
    } catch (const std::invalid_argument& error) {
      throw data::StoreRefused(store.path() + ": " + error.what());
    }
  }
  return false;
}

}  // namespace

protocols::Protocol protocol_as_shown(data::Store& store, const data::StoredTrial& trial,
                                      const std::string& mesh_folder, bool& limited) {
  protocols::Protocol protocol = stored_protocol(store, trial, mesh_folder);
  limited = limited_by_a_note(protocol, store, trial);
  return protocol;
}

std::string to_string(const data::TrialName& name) {
  return name.code + "/" + std::to_string(name.session) + "/" + std::to_string(name.trial);
}

RecordedTrial load_recorded_trial(data::Store& store, const data::TrialName& name,
                                  const std::string& protocol, const std::string& mesh_folder) {
  RecordedTrial trial;
  trial.stored = find_trial(store, name, protocol);
  trial.protocol = stored_protocol(store, trial.stored, mesh_folder);
  const std::string& shape = trial.stored.record.shape;
  const auto& stimuli = trial.protocol.stimuli;
  if (std::none_of(stimuli.begin(), stimuli.end(),
                   [&](const auto& stimulus) { return stimulus.name == shape; })) {
    throw data::StoreRefused(store.path() + ": trial " + to_string(name) + " shows '" + shape +
                             "', which its protocol " + trial.stored.protocol_name +
                             " does not have; expected one of its stimuli");
  }
  trial.limited = limited_by_a_note(trial.protocol, store, trial.stored);
  return trial;
}

}  // namespace palpate::runner::session
