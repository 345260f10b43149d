#include "data/export/derived_table.h"

namespace palpate::data {

DerivedTable::DerivedTable(const std::string& path, DelimitedFormat format,
                           const DerivedMeasures& measures)
    : measures_(measures), file_(path), row_(format) {
  row_ << std::span<const Column>(trial_names());
  for (const DerivedColumn& column : measures_.columns) row_ << column.name;
  row_ << missing().name;
  file_.write(row_.end());
}

void DerivedTable::add(const StoredTrial& trial) {
  const TrialRecord& record = trial.record;
  const DerivedMeasures::Values values = measures_.of(trial);
  row_ << trial.participant.code << record.session << record.block << record.trial
       << record.renderer << record.shape;
  for (std::size_t k = 0; k < measures_.columns.size(); ++k) {
    if (k < values.numbers.size())
      row_ << values.numbers[k];
    else
      row_ << "";
  }
  row_ << values.missing;
  file_.write(row_.end());
}

const std::vector<Column>& DerivedTable::trial_names() {
  static const std::vector<Column> all = {
      {"participant_id", "Pseudonym of the participant"},
      {"session", "Session, from 1", "1"},
      {"block", "Block within the session, from 1", "1"},
      {"trial", "Trial within the session, from 1", "1"},
      {"renderer", "Renderer of the shape"},
      {"shape", "The stimulus shown", "", {}, Column::Names::stimuli},
  };
  return all;
}

const Column& DerivedTable::missing() {
  static const Column why{"missing",
                          "Reason why the trial has no numbers; missing itself if it has them"};
  return why;
}

nlohmann::ordered_json describe_derived(const DerivedMeasures& measures,
                                        const ProtocolFacts& facts) {
  nlohmann::ordered_json json;
  for (const Column& column : DerivedTable::trial_names())
    json[column.name] = describe_column(column, facts, {});
  for (const DerivedColumn& column : measures.columns) {
    json[column.name] = {{"Description", column.description}};
    if (column.unit != "1") json[column.name]["Units"] = column.unit;
  }
  const Column& why = DerivedTable::missing();
  json[why.name] = describe_column(why, facts, {});
  return json;
}

}  // namespace palpate::data
