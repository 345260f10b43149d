#pragma once
// Export as a Psych-DS dataset.

#include <string>

#include "data/export/settings.h"
#include "data/store/store.h"

namespace palpate::data {

/// Writes the completed trials as a Psych-DS dataset (https://psych-ds.github.io):
///
///   dataset_description.json, README.md
///   data/subject-CODE/study-T_subject-CODE_data.csv      all sessions, the columns of trials.csv
///   data/subject-CODE/study-T_subject-CODE_session-S_description-haptic_data.csv
///                                                        servo samples, where they are stored
///   data/study-T_description-attempts_data.csv           attempts that were cut off
///   materials/T_protocol.json                            the protocol's text, byte for byte
///   materials/T/                                         the files that it names (meshes)
///
/// T is the protocol's name without '-'. variableMeasured describes exactly the columns that are
/// there. Experimenter's notes are not exported. The folder appears complete or not at all.
/// \throws StoreRefused: `path` exists (see require_replaceable), there are no trials;
/// StoreError: it could not be written.
ExportResult export_psychds(Store& store, const std::string& path, const ExportSettings& settings);

}  // namespace palpate::data
