#include "analysis/input/study_record.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "analysis/input/trials.h"
#include "analysis/text.h"
#include "data/base/text.h"
#include "data/store/store.h"
#include "data/stored_protocol.h"

namespace palpate::analysis {

void TorqueCounts::add(std::string_view renderer, std::optional<bool> driven) {
  if (!driven) return;
  auto found = counts_.find(renderer);
  if (found == counts_.end()) found = counts_.emplace(renderer, Count{}).first;
  ++found->second.trials;
  if (!*driven) ++found->second.left_out;
}

void TorqueCounts::warn(std::vector<std::string>& warnings) const {
  for (const auto& [renderer, count] : counts_) {
    if (count.left_out == 0) continue;
    warnings.push_back("In " + std::to_string(count.left_out) + " of " +
                       counted(count.trials, "trial", "trials") + " with " +
                       printable(renderer, 40) +
                       " torque was left out: the device drives force alone.");
  }
}

namespace {

void remember(const std::string& value, std::vector<std::string>& known) {
  if (!value.empty() && std::ranges::find(known, value) == known.end()) known.push_back(value);
}

ProtocolText protocol_text(const data::ProtocolInfo& info) {
  const data::StoredProtocol stored = data::read_stored_protocol(info.text);
  return {info.name, info.sha256, info.text, stored.title, stored.seed};
}

}  // namespace

void add_trial(const ServoTrial& trial, std::vector<ServoQuality>& all) {
  auto at = std::ranges::lower_bound(all, trial.renderer, {}, &ServoQuality::renderer);
  if (at == all.end() || at->renderer != trial.renderer) {
    at = all.insert(at, ServoQuality());
    at->renderer = trial.renderer;
  }
  ServoQuality& servo = *at;
  ++servo.n_trials;
  servo.n_with_missed += trial.missed_ticks > 0 ? 1 : 0;
  servo.n_with_faults += trial.faults ? 1 : 0;
  servo.n_started_inside += trial.started_inside ? 1 : 0;
  servo.ticks += trial.ticks;
  servo.missed_ticks += trial.missed_ticks;
  servo.max_force = std::max(servo.max_force, trial.max_force);
  if (!(trial.longest_period > 0)) return;
  servo.longest_period = std::max(servo.longest_period, trial.longest_period);
  const double bin =
      ServoQuality::kBinsPerDecade * std::log10(trial.longest_period / ServoQuality::kLowest);
  ++servo.longest_periods[static_cast<std::size_t>(
      std::clamp(bin + 1e-9, 0.0, ServoQuality::kBins - 1.0))];
}

StudyRecord read_study_record(data::Store& store, const std::string& protocol) {
  StudyRecord record;
  std::set<std::string, std::less<>> wanted;  // checksums
  for (const data::ProtocolInfo& one : store.protocols()) {
    if (!is_protocol(protocol, one.name, one.sha256)) continue;
    wanted.insert(one.sha256);
    record.protocols.push_back(protocol_text(one));
    for (const data::Participant& participant : store.participants(one.sha256)) {
      if (participant.seed)
        record.seeds.push_back(participant.code + ": " + std::to_string(*participant.seed));
    }
  }
  for (const data::StoredRun& run : store.runs()) {
    if (!wanted.contains(run.protocol_sha256)) continue;
    remember(run.info.device, record.devices);
    remember(run.info.build, record.builds);
    remember(run.info.response_device, record.response_devices);
  }
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (trial.record.practice || !wanted.contains(trial.protocol_sha256)) return;
    const data::TrialRecord& one = trial.record;
    add_trial({one.renderer, one.ticks, one.missed_ticks,
               static_cast<double>(one.longest_period_ns) / 1e9, one.faults != 0,
               one.started_inside, one.max_force},
              record.servo);
  });
  store.for_each_cut_off([&](const data::StoredTrial& attempt) {
    record.n_cut_off += wanted.contains(attempt.protocol_sha256) ? 1 : 0;
  });
  return record;
}

}  // namespace palpate::analysis
