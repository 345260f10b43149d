#pragma once
// Internal to data/export: a table of numbers that were derived from the samples of trials.

#include <optional>
#include <string>
#include <vector>

#include "data/export/dataset_description.h"
#include "data/export/delimited_row.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"
#include "data/store/store.h"

namespace palpate::data {

/// One row for each trial without practice: which one it is, the numbers, and why there are none.
class DerivedTable {
 public:
  DerivedTable(const std::string& path, DelimitedFormat format, const DerivedMeasures& measures);
  void add(const StoredTrial& trial);
  void close() { file_.close(false); }

  /// Columns that say which trial it is, before the numbers; and after them, why there are none.
  static const std::vector<Column>& trial_names();
  static const Column& missing();

 private:
  const DerivedMeasures& measures_;
  FileSink file_;
  DelimitedRow row_;
};

/// What a sidecar says of each column.
nlohmann::ordered_json describe_derived(const DerivedMeasures& measures,
                                        const ProtocolFacts& facts);

}  // namespace palpate::data
