#pragma once
// Answers to pages as a table. Personal data: written only when asked for.

#include <cstdint>
#include <span>

#include "data/export/clock.h"
#include "data/export/exported_columns.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"

namespace palpate::data {

/// Of pages.csv, in order.
std::span<const Column> page_columns();

/// RFC 4180: a row for each answer, by protocol, participant, session and time. \return  rows
std::int64_t write_pages(Store& store, TextSink& out, const ExportClock& clock,
                         ExportedParticipants& participants);

}  // namespace palpate::data
