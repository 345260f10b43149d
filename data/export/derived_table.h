#pragma once
// Internal to data/export: a table of numbers derived from the samples of trials.

#include <optional>
#include <string>
#include <vector>

#include "data/export/dataset_description.h"
#include "data/export/delimited_row.h"
#include "data/export/exported_columns.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"
#include "data/store/store.h"

namespace palpate::data {

/// One row for each trial except practice: its identity, the numbers, and the reason if they are
/// missing.
class DerivedTable {
 public:
  DerivedTable(const std::string& path, DelimitedFormat format, const DerivedMeasures& measures);
  void add(const StoredTrial& trial);
  void close() { file_.close(false); }

  /// Columns that identify the trial, before the numbers; and after them, the reason if they are
  /// missing.
  static const std::vector<Column>& trial_names();
  static const Column& missing();

 private:
  const DerivedMeasures& measures_;
  FileSink file_;
  DelimitedRow row_;
};

/// The description of each column in a sidecar.
nlohmann::ordered_json describe_derived(const DerivedMeasures& measures,
                                        const ProtocolFacts& facts);

}  // namespace palpate::data
