#include "runner/commands/movement/movement_export.h"

#include <utility>

#include "analysis/text.h"
#include "data/base/text.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner::commands {

void MovementExport::add_contacts(data::ExportSettings& settings) {
  settings.contacts = [this](const data::StoredTrial& trial) {
    auto contacts = contacts_of(*stimuli_.of(store_, trial), trial);
    if (contacts.empty() && !trial.record.samples.empty()) ++not_rendered_;
    return contacts;
  };
}

void MovementExport::add_measures(data::ExportSettings& settings, const MovementRequest& request) {
  MovementStudy study = measure_study(request);
  require_samples(study, request.database);
  for (const auto& [trial, row] : study.rows) {
    data::DerivedMeasures::Values& values = measured_[trial];
    values.missing = study.missing[row];
    if (values.missing.empty())
      values.numbers.assign(study.table.values[row].begin(), study.table.values[row].end());
  }
  data::DerivedMeasures derived;
  derived.name = "movement";
  derived.how = "The path was filtered with a low pass at " +
                analysis::fixed(request.settings.cutoff, 1) +
                " Hz; contacts come from rendering each trial again, to the bit.";
  for (const auto& one : analysis::measure_definitions()) {
    derived.columns.push_back({one.name, std::string("Movement: ") + one.meaning, one.unit});
  }
  derived.of = [this](const data::StoredTrial& trial) {
    const auto found = measured_.find(key_of(trial));
    if (found != measured_.end()) return found->second;
    return data::DerivedMeasures::Values{{}, "it was added while the export was written"};
  };
  settings.derived = std::move(derived);
}

}  // namespace palpate::runner::commands
