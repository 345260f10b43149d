#include "data/export/trial_table.h"

#include <string>
#include <vector>

#include "data/export/clock.h"
#include "data/export/column_values.h"
#include "data/export/exported_columns.h"

namespace palpate::data {
namespace {

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const Column& column : trial_columns(ExportClock())) out.emplace_back(column.name);
  return out;
}

}  // namespace

TrialTable::TrialTable() : table_(names()) {}

void TrialTable::add(const StoredTrial& trial) {
  table_ << trial.participant.code;
  put_plain_columns(table_, trial, ExportClock());
  table_.end_row();
}

}  // namespace palpate::data
