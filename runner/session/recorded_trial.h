#pragma once
// A trial of a database with all data for rendering it again.

#include <string>

#include "data/store/store.h"
#include "protocols/protocol.h"

namespace palpate::runner::session {

/// Its record, its protocol and the materials as its device showed them.
struct RecordedTrial {
  data::StoredTrial stored;
  protocols::Protocol protocol;  ///< materials as limited to the device of its run
  bool limited = false;          ///< some materials were limited
};

/// The completed attempt at a trial.
/// \param protocol     the protocol's name, where the code is enrolled in several; empty: any
/// \param mesh_folder  folder of the mesh files, for an old database that does not contain them
/// \throws StoreRefused: the trial is missing, is in several protocols, has no samples, or its
/// record and protocol disagree; InputError, MeshError: the stored protocol cannot be read
RecordedTrial load_recorded_trial(data::Store& store, const data::TrialName& name,
                                  const std::string& protocol, const std::string& mesh_folder);

/// The protocol that a trial was shown with, its materials limited as its device showed them.
/// \param limited  set if any were limited
/// \throws StoreRefused, InputError, MeshError: the stored protocol cannot be read
protocols::Protocol protocol_as_shown(data::Store& store, const data::StoredTrial& trial,
                                      const std::string& mesh_folder, bool& limited);

/// "P03/1/12"
std::string to_string(const data::TrialName& name);

}  // namespace palpate::runner::session
