#pragma once
// Export as CSV: one row per trial.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/export/clock.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"

namespace palpate::data {

/// The table of attempts that were cut off, common to all formats: RFC 4180 with a header.
/// \return rows
std::int64_t write_attempts(Store& store, TextSink& out, const ExportClock& clock,
                            ExportedParticipants& participants, ProgressCounter& counter);

/// Writes every completed trial to `path`, a file NAME.csv. Where attempts were cut off, writes
/// those to NAME_attempts.csv in the same folder, and answers to pages to NAME_pages.csv; beside
/// trials.csv these are attempts.csv and pages.csv. UTF-8 without BOM, RFC 4180 (lines end in CRLF,
/// fields quoted only where needed), numbers as the shortest text that reads back exactly; texts
/// that a spreadsheet would evaluate are guarded (text_sink.h). settings.codebook names a file for
/// the meaning of the columns. Columns: exported_columns.h. Each file appears complete or not at
/// all (atomic_file.h), and the database records the export.
///
/// \throws StoreRefused: a file exists and `force` is not given, or `path` must not be written to;
/// StoreError: it could not be written. No file is left behind then.
ExportResult export_csv(Store& store, const std::string& path, const ExportSettings& settings);
inline ExportResult export_csv(Store& store, const std::string& path, bool force) {
  return export_csv(store, path, ExportSettings{.force = force});
}

/// table, column, unit, value, meaning: a row for each column, followed by one for each of its
/// codes or fault bits. The first row holds these names.
using CodebookRow = std::array<std::string, 5>;

/// The codebook that export_csv() writes for a database with these protocols, its texts guarded,
/// without the rows of the column torque_driven, which sessions add.
std::vector<CodebookRow> codebook_of(const std::vector<ProtocolInfo>& protocols,
                                     const ExportSettings& settings);

/// Export of a sweep as CSV: one row a point.
/// Writes the points on record, in order, with the columns of sweep_columns(). As export_csv()
/// writes: RFC 4180, the shortest texts of numbers that read back exactly, texts guarded; complete
/// or not at all. Undefined figures and those of failed points are empty. \param progress called
/// with the points written; may throw to stop \return points. \throws StoreRefused: the file exists
/// and `force` is not given, or must not be written to; StoreError
std::int64_t export_sweep_csv(SweepFile& sweep, const std::string& path, bool force,
                              const std::function<void(std::int64_t)>& progress = {});

}  // namespace palpate::data
