#pragma once

#include <string>

#include "data/export.h"
#include "data/store.h"

namespace palpate {

/// Writes the completed trials as a BIDS dataset (behaviour, https://bids.neuroimaging.io):
///
///   dataset_description.json, README, participants.tsv and .json
///   sub-CODE/ses-S/beh/sub-CODE_ses-S_task-T_beh.tsv and .json   a session, one row a trial
///   sourcedata/T_protocol.json                                   the protocol's text, byte for
///   byte sourcedata/attempts.csv                                      attempts that were cut off
///
/// T is the protocol's name without '-'. Rows are sorted by onset (s, from the session's first
/// trial); their other columns are those of trials.csv but for participant_id.
///
/// Where servo samples are stored, every trial of the session is a BIDS run of its own, run-N for
/// trial N: ..._run-0007_beh.tsv with one row, onset 0, and
/// ..._run-0007_recording-haptic_physio.tsv.gz with one row a servo tick. Its StartTime is counted
/// from that onset. Ticks that were not recorded are rows of n/a.
///
/// Experimenter's notes are not exported. The folder is made whole or not at all.
/// \throws StoreRefused: `path` is taken (see require_replaceable), there are no trials, a text
/// does not fit a TSV file; StoreError: it could not be written.
ExportDone export_bids(Store& store, const std::string& path, const ExportSettings& settings);

}  // namespace palpate
