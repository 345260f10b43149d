#include "data/export/trial_table.h"

#include "data/export/column_values.h"

namespace palpate::data {
namespace {

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const Column& column : trial_columns(Times::absolute)) out.emplace_back(column.name);
  return out;
}

}  // namespace

TrialTable::TrialTable() : table_(names()) {}

void TrialTable::add(const StoredTrial& trial) {
  put_trial(table_, trial, ExportClock());
  table_.end_row();
}

}  // namespace palpate::data
