#pragma once
// Internal to data/: what the columns of trials.csv and attempts.csv mean, as a table.

#include "data/export/column_definitions.h"
#include "data/export/dataset_description.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"

namespace palpate::data {

/// RFC 4180 with the header table,column,unit,value,meaning: a row for each column, then one for
/// each value or bit that stands for something.
void write_codebook(TextSink& out, const ProtocolFacts& facts, const ExportSettings& settings);

}  // namespace palpate::data
