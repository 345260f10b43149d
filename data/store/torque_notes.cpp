#include "data/store/torque_notes.h"

#include <algorithm>

namespace palpate::data {
namespace {

/// The point alone has no side, and gives force only.
bool gives_torque(const std::string& renderer) { return !renderer.empty() && renderer != "point"; }

}  // namespace

TorqueNotes::TorqueNotes(Store& store) {
  for (const StoredNote& note : store.notes()) {
    if (note.text == kTorqueLeftOutNote)
      runs_.emplace(note.participant.id, note.session, note.run_clock.utc_ns,
                    note.run_clock.monotonic_ns);
  }
}

bool TorqueNotes::left_out(const Participant& participant, const RunInfo& run) const {
  return any() && runs_.contains(RunKey(participant.id, run.session, run.clock.utc_ns,
                                        run.clock.monotonic_ns));
}

std::optional<bool> TorqueNotes::driven(const StoredTrial& trial) const {
  bool given = gives_torque(trial.record.renderer);
  if (trial.record.task) {
    given = given ||
            std::ranges::any_of(trial.record.task->intervals, [](const IntervalRecord& interval) {
              return gives_torque(interval.renderer);
            });
  }
  if (!given) return std::nullopt;
  return !left_out(trial.participant, trial.run);
}

}  // namespace palpate::data
