#pragma once
// The trials of a study, from a database or a table, whatever it asked.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/input/study_record.h"
#include "analysis/input/trials.h"
#include "data/store/participant_columns.h"
#include "protocols/tasks/block_procedures.h"

namespace palpate::analysis {

/// The groups of the participants whose trials are in a table.
struct GroupLabels {
  std::vector<std::string> names;         ///< in the protocol's order; empty: no groups
  std::map<std::string, std::size_t> of;  ///< participant -> index of the group
  /// \return the participant's group: another one if it was known before
  const std::string& add(const std::string& participant, const std::string& group);
};

/// A factor within participants besides renderer, stimulus and level.
struct StudyFactor {
  std::string name;
  std::vector<std::string> levels;  ///< in the protocol's order
};

/// The trials of a study. One of shapes alone has only `times`.
struct StudyTable {
  std::string source;              ///< path as the user gave it
  std::vector<StudyTrial> trials;  ///< of blocks of tasks, in the order of the source
  /// Identification without catch trials and levels; none: nothing is identified, or the source
  /// lacks its times or numbers.
  std::optional<TrialTable> times;
  std::size_t n_practice = 0;           ///< left out
  bool simulated = false;               ///< some participants are simulated
  Simulated of_trials = Simulated::no;  ///< without practice
  Provenance provenance;                ///< of all trials
  std::string title;                    ///< of the study, from its protocol; "": unknown
  std::vector<std::string> warnings;
  GroupLabels group_labels;
  std::vector<StudyFactor> factors;  ///< crossed; a trial's cell is in the name of its stimulus
  std::vector<std::string> tests;    ///< effects that the protocols name; empty: all
  /// Answers that describe the participants of these trials; from databases only.
  std::vector<data::ParticipantColumn> people;
  /// Their protocols: name and SHA-256, each once.
  std::vector<std::pair<std::string, std::string>> protocols;
  /// The procedures, by procedures_key and name of the block; of a table only if its protocols were
  /// given.
  std::map<std::string, std::map<std::string, protocols::BlockProcedures>> procedures;
};

/// The procedure of a trial's block; nullptr: the source has no protocol.
const protocols::BlockProcedures* block_of(const StudyTrial& trial, const StudyTable& table);

/// Adds to trials what their protocols say of them: procedures, title, groups and factors. Trials
/// of a track that cells share are of its plain stimulus. \param path  of the source, for messages
void put_protocols(const std::vector<ProtocolText>& protocols, const std::string& path,
                   StudyTable& table);

/// Reads an export of trials. Those of tasks need participant_id, task, renderer and shape; level,
/// standard_level, success, number, confidence, ... are optional. Those of a study of shapes: see
/// read_trials_csv.
/// \param wanted  protocols to read (is_protocol); empty: all
/// \param protocols  of the study, with their texts: their names, procedures and order of shapes
/// belong to the trials, as in a database
/// \throws protocols::InputError with every fault.
StudyTable read_study_csv(const std::string& path, const std::vector<std::string>& wanted = {},
                          const std::vector<ProtocolText>& protocols = {});

/// Reads the completed trials of a database. \param protocol  the one that is wanted; "": all
/// \throws protocols::InputError: there are none
StudyTable read_study_store(data::Store& store, const std::string& protocol = "");

/// Sets `times` from trials of tasks.
void identify_times(StudyTable& table);

}  // namespace palpate::analysis
