#pragma once
// The record of a database's exports: forget lists those that hold a withdrawn participant.

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

struct ExportRecord {
  std::string path;    ///< relative to the database where it lies below its folder
  std::string format;  ///< "csv", "bids", "psych-ds"
  std::int64_t made_utc_ns = 0;
};

/// The absolute path of a recorded one; "" outside of the folder of the database.
std::string export_location(const std::string& database, const std::string& recorded);

/// Records an export (`made.path` absolute or relative) of these participants (row ids), replacing
/// an earlier one at the same path. Works beside a writer; migrates a database of an older schema
/// first. \throws StoreRefused: a participant was withdrawn after the data were read; StoreError:
/// the database cannot be written to.
void log_export(const std::string& database, const ExportRecord& made,
                const std::vector<std::int64_t>& participants);

/// Collects the participants of an export while it is written, and records it before it is renamed
/// to its final name.
class ExportedParticipants {
 public:
  void add(const Participant& participant);
  bool any_simulated() const { return any_simulated_; }

  /// \return the reason why it was not recorded (read-only disk), or "". \throws StoreRefused: one
  /// of them was withdrawn meanwhile.
  std::string record(const std::string& database, const std::string& path,
                     const std::string& format) const;

 private:
  std::vector<std::int64_t> ids_;  // without duplicates
  bool any_simulated_ = false;
};

}  // namespace palpate::data
