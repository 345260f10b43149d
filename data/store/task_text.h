#pragma once
// Internal to data/store: a trial's task in the database, one line of JSON. Keys without a value
// are left out. A trial of no block stores none.

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "data/record.h"
#include "data/store/store.h"

namespace palpate::data {

/// Whether it can be read again: without a text a task is identification.
bool is_storable(const TaskRecord& task);
std::optional<std::string> task_text(const TaskRecord& task);
/// The inverse. \throws std::invalid_argument: damaged
TaskRecord parse_task_text(const std::optional<std::string>& text);

/// The note of a run with a device that senses the stylus's axis but drives force alone.
inline constexpr const char* kTorqueLeftOutNote = R"({"torque":"left out"})";

/// Runs in which the renderer's torque was left out; each has a note.
class TorqueNotes {
 public:
  TorqueNotes() = default;
  explicit TorqueNotes(Store& store);

  /// Whether torque was left out in a run.
  bool any() const { return !runs_.empty(); }
  bool left_out(const Participant& participant, const RunInfo& run) const;
  /// Whether the device drove the torque of the trial's renderer; missing if the renderer gives
  /// none.
  std::optional<bool> driven(const StoredTrial& trial) const;

 private:
  /// Participant, session, and start of the run on both clocks.
  using RunKey = std::tuple<std::int64_t, int, std::int64_t, std::int64_t>;
  std::set<RunKey> runs_;
};

}  // namespace palpate::data
