#pragma once
// Internal to data/export: times of an export, absolute (UTC) or relative to the participant's
// first trial.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "data/export/settings.h"
#include "data/store/participant_groups.h"
#include "data/store/store.h"
#include "data/store/task_text.h"
#include "data/stored_protocol.h"

namespace palpate::data {

class ExportClock {
 public:
  ExportClock(Store& store, Times times);
  /// For the columns alone: without sessions, and so without times and torque_driven.
  ExportClock(const std::vector<ProtocolInfo>& protocols, Times times);
  ExportClock() : times_(Times::absolute) {}

  /// By checksum. Rows of trials have the columns that any of them needs.
  const std::map<std::string, StoredProtocol, std::less<>>& protocols() const { return protocols_; }
  /// Rows of trials have the column torque_driven if any run left torque out.
  const TorqueNotes& torque() const { return torque_; }

  /// Rows of participants have the column group if any protocol has groups.
  const ParticipantGroups& groups() const { return groups_; }

  /// Rows of trials have a column for each factor of a protocol.
  const std::vector<StoredFactor>& factors() const { return factors_; }

  /// Rows of trials have a column for each dimension of a block's level, by its name.
  const std::vector<std::string>& dimensions() const { return dimensions_; }

  Times times() const { return times_; }
  bool relative() const { return times_ == Times::relative; }
  /// ISO 8601 of the onset of a trial, or of the start of an attempt that was cut off.
  std::string onset_utc(const StoredTrial& trial) const;
  /// s from the participant's first trial to the same moment.
  double elapsed(const StoredTrial& trial) const;
  /// ISO 8601 of any moment of a participant. \param unix_ns ns since 1970
  std::string utc(const Participant& person, std::int64_t unix_ns) const;
  /// Removes dates from a text (of a device's calibration) if times are relative.
  std::string without_dates(const std::string& text) const;

 private:
  std::int64_t since_first(const Participant& person, std::int64_t unix_ns) const;  // ns
  Times times_;
  std::map<std::string, StoredProtocol, std::less<>> protocols_;
  TorqueNotes torque_;
  ParticipantGroups groups_;
  std::vector<StoredFactor> factors_;
  std::vector<std::string> dimensions_;
  std::map<std::string, std::int64_t, std::less<>> firsts_;  // code -> ns since 1970
};

}  // namespace palpate::data
