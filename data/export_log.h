#pragma once
// Which exports were made of a database: forget lists those that hold who has withdrawn.

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

struct ExportRecord {
  std::string path;    ///< absolute
  std::string format;  ///< "csv", "bids", "psych-ds"
  std::int64_t made_utc_ns = 0;
};

/// Adds an export that holds these participants (the store's keys), in place of an earlier one at
/// the same path. Works beside a writer; brings a database of an older schema up to date first.
/// \throws StoreRefused: a participant has been withdrawn since the data were read; StoreError: the
/// database may not be written to.
void log_export(const std::string& database, const ExportRecord& made,
                const std::vector<std::int64_t>& participants);

}  // namespace palpate
