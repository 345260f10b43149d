#pragma once
// Where the renderer's torque was left out: runs say so by a note.

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "data/store/store.h"

namespace palpate::data {

/// The note of a run whose device senses the stylus's axis and drives force alone.
inline constexpr const char* kTorqueLeftOutNote = R"({"torque":"left out"})";

class TorqueNotes {
 public:
  TorqueNotes() = default;
  explicit TorqueNotes(Store& store);

  /// Whether torque was left out in a run.
  bool any() const { return !runs_.empty(); }
  bool left_out(const Participant& participant, const RunInfo& run) const;
  /// Whether the device drove the torque of the trial's renderer; missing where that gives none.
  std::optional<bool> driven(const StoredTrial& trial) const;

 private:
  /// Participant, session, and when it began on both clocks.
  using RunKey = std::tuple<std::int64_t, int, std::int64_t, std::int64_t>;
  std::set<RunKey> runs_;
};

}  // namespace palpate::data
