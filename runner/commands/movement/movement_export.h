#pragma once
// Movement in exports: the contact of each sample, and the measures of each trial.

#include <cstddef>
#include <map>
#include <string>
#include <tuple>

#include "data/export/settings.h"
#include "data/store/store.h"
#include "runner/commands/movement/movement_study.h"
#include "runner/commands/movement/touched_trial.h"

namespace palpate::runner::commands {

/// Adds movement to the settings of an export. Must outlive that export.
class MovementExport {
 public:
  MovementExport(data::Store& store, std::string mesh_folder)
      : store_(store), stimuli_(std::move(mesh_folder)) {}

  /// Adds places and normals of the contacts to the samples, by rendering each trial again.
  void add_contacts(data::ExportSettings& settings);
  /// Tables of the measures. \throws UsageError: no trial has samples
  void add_measures(data::ExportSettings& settings, const MovementRequest& request);
  /// Trials without contacts because rendering does not reproduce their recorded forces.
  std::size_t not_rendered() const { return not_rendered_; }

 private:
  data::Store& store_;
  StudyStimuli stimuli_;
  std::size_t not_rendered_ = 0;
  std::map<MovementStudy::TrialKey, data::DerivedMeasures::Values> measured_;
};

}  // namespace palpate::runner::commands
