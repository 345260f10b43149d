#pragma once
// Export as a BIDS or a Psych-DS dataset.

#include <string>

#include "data/export/settings.h"
#include "data/store/store.h"

namespace palpate::data {

/// Writes the completed trials as a BIDS dataset (behaviour, https://bids.neuroimaging.io):
///
///   dataset_description.json, README, participants.tsv and .json
///   sub-CODE/ses-S/beh/sub-CODE_ses-S_task-T_beh.tsv and .json   a session, one row a trial
///   sourcedata/T_protocol.json   the protocol's text, byte for byte
///   sourcedata/attempts.csv      attempts that were cut off
///   stimuli/T/                   the files that the protocol names (meshes)
///
/// T is the protocol's name without '-'. Rows are sorted by onset (s, from the session's first
/// trial); their other columns are those of trials.csv but for participant_id.
///
/// If servo samples are stored, the session is split into BIDS runs: a new one with every start of
/// the program and after more than a minute without a trial. Each has a table, ..._run-1_beh.tsv,
/// and one recording, ..._run-1_recording-haptic_physio.tsv.gz, with one row per servo period; its
/// sidecar has the rows, poses and renderers of the trials, and the objects. Memory holds the
/// samples of one trial at a time.
///
/// Experimenter's notes are not exported. The folder appears complete or not at all.
/// \throws StoreRefused: `path` exists (see require_replaceable), there are no trials, a text
/// does not fit a TSV file; StoreError: it could not be written.
ExportResult export_bids(Store& store, const std::string& path, const ExportSettings& settings);

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
