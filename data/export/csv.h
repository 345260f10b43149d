#pragma once

#include <string>

#include "data/export/settings.h"
#include "data/store/store.h"

namespace palpate::data {

/// Writes every completed trial to `path` and, where attempts were cut off, those to attempts.csv
/// in the same folder. UTF-8, no BOM, RFC 4180 (lines end in CRLF, fields quoted only where
/// needed), numbers as the shortest text that reads back exactly; texts that a spreadsheet would
/// run are guarded (spreadsheet_text.h), the others as they are stored. What the columns mean goes
/// to `settings.codebook` where that is named. Each file is written to a temporary one beside it,
/// synced and renamed: it is whole or it is not there. The database records that the export was
/// made.
///
/// Columns: columns.h.
///
/// \throws StoreRefused: a file is there and `force` is not given, or `path` is no place for it;
/// StoreError: it could not be written. Nothing is left behind then.
ExportResult export_csv(Store& store, const std::string& path, const ExportSettings& settings);
inline ExportResult export_csv(Store& store, const std::string& path, bool force) {
  return export_csv(store, path, ExportSettings{.force = force});
}

}  // namespace palpate::data
