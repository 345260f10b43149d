#pragma once
// Internal to data/export: a table that explains the columns of trials.csv and attempts.csv.

#include <span>

#include "data/export/column_definitions.h"
#include "data/export/dataset_description.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"

namespace palpate::data {

/// RFC 4180 with the header table,column,unit,value,meaning: a row for each column, followed by one
/// for each of its codes or fault bits. \param trials  columns of trials.csv
void write_codebook(TextSink& out, const ProtocolFacts& facts, const ExportSettings& settings,
                    std::span<const Column> trials);

}  // namespace palpate::data
