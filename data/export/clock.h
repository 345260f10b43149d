#pragma once
// Internal to data/: how an export tells when something happened.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "data/export/settings.h"
#include "data/store/store.h"

namespace palpate::data {

class ExportClock {
 public:
  ExportClock(Store& store, Times times);

  Times times() const { return times_; }
  bool relative() const { return times_ == Times::relative; }
  /// Of a trial's onset, or of the begin of an attempt that was cut off.
  std::string onset_utc(const StoredTrial& trial) const;
  /// s, the same moment from the participant's first trial.
  double elapsed(const StoredTrial& trial) const;
  /// Any moment of a participant's, ns since 1970.
  std::string utc(const Participant& person, std::int64_t unix_ns) const;
  /// What a device says of its calibration may hold a date: left out of relative times.
  std::string without_dates(const std::string& text) const;

 private:
  std::int64_t since_first(const Participant& person, std::int64_t unix_ns) const;  // ns
  Times times_;
  std::map<std::string, std::int64_t, std::less<>> firsts_;  // code -> ns since 1970
};

}  // namespace palpate::data
