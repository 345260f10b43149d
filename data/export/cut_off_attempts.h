#pragma once
// Internal to data/export: the table of attempts that were cut off, the same in every format.

#include "data/export/clock.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"

namespace palpate::data {

/// RFC 4180 with a header. \return rows
std::int64_t write_attempts(Store& store, TextSink& out, const ExportClock& clock,
                            ExportedParticipants& participants, ProgressCounter& counter);

}  // namespace palpate::data
