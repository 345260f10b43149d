#pragma once
// Internal to data/: attempts.csv, the same in every export.

#include "data/export.h"
#include "data/export_clock.h"
#include "data/export_log.h"
#include "data/store.h"
#include "data/text_sink.h"

namespace palpate {

/// Writes all attempts that were cut off, RFC 4180 with a header. \return rows
std::int64_t write_attempts(Store& store, TextSink& out, const ExportClock& clock,
                            ExportedPeople& people, ProgressCounter& counter);

}  // namespace palpate
