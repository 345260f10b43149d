#pragma once
// Completed trials in memory, as trials.csv has them.

#include "data/column_table.h"
#include "data/store/store.h"

namespace palpate::data {

/// Columns with the names, order and values of an exported trials.csv with absolute times; texts
/// are not guarded against spreadsheets.
class TrialTable {
 public:
  TrialTable();
  void add(const StoredTrial& trial);
  const ColumnTable& table() const { return table_; }

 private:
  ColumnTable table_;
};

}  // namespace palpate::data
