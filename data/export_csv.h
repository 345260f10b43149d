#pragma once

#include <cstdint>
#include <string>

#include "data/store.h"

namespace palpate {

struct CsvExport {
  std::int64_t trials = 0;    ///< rows of the file
  std::int64_t attempts = 0;  ///< rows of attempts.csv; 0: it was not written
  std::string attempts_path;
};

/// Writes every completed trial to `path` and, where attempts were cut off, those to attempts.csv
/// in the same folder. UTF-8, no BOM, RFC 4180 (lines end in CRLF, fields quoted only where
/// needed), numbers as the shortest text that reads back exactly. Each file is written to a
/// temporary one beside it, synced and renamed: it is whole or it is not there.
///
/// Columns after those of the contract: participant_number; started_inside (0 or 1: the stylus was
/// inside an object at time zero); ticks; longest_period (s, between two ticks); faults (or of all
/// fault bits); max_force (N); observer_sha256 (simulated participants, else empty).
///
/// \throws StoreRefused: a file is there and `force` is not given, or `path` is no place for it;
/// StoreError: it could not be written. Nothing is left behind then.
CsvExport export_csv(Store& store, const std::string& path, bool force);

}  // namespace palpate
