#pragma once
// Which exports were made of a database: forget lists those that hold who has withdrawn.

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

struct ExportRecord {
  std::string path;    ///< as recorded_path() has it
  std::string format;  ///< "csv", "bids", "psych-ds"
  std::int64_t made_utc_ns = 0;
};

/// What is put on record of an export at `path`: relative to the database's folder, or, for a place
/// outside of it, its name with a tag of the place, "trials.csv (elsewhere, 1f3c9a02)". A database
/// that is handed on tells nothing of the folders of a computer.
std::string recorded_path(const std::string& database, const std::string& path);

/// Where that is; "" for a place outside of the database's folder.
std::string export_location(const std::string& database, const std::string& recorded);

/// Adds an export (`made.path`: where it is) that holds these participants (the store's keys), in
/// place of an earlier one at the same path. Works beside a writer; brings a database of an older
/// schema up to date first. \throws StoreRefused: a participant has been withdrawn since the data
/// were read; StoreError: the database may not be written to.
void log_export(const std::string& database, const ExportRecord& made,
                const std::vector<std::int64_t>& participants);

/// Gathers who is in an export while it is written, and records it before it gets its name.
class ExportedParticipants {
 public:
  void add(const Participant& participant);
  bool any_simulated() const { return any_simulated_; }
  bool all_simulated() const { return any_simulated_ && !any_real_; }

  /// \return why it cannot be recorded (a read-only disk), "" when it is. \throws StoreRefused: one
  /// of them was withdrawn meanwhile.
  std::string record(const std::string& database, const std::string& path,
                     const std::string& format) const;

 private:
  std::vector<std::int64_t> ids_;  // each once: the rows of a participant follow each other
  bool any_simulated_ = false, any_real_ = false;
};

}  // namespace palpate::data
