#pragma once
// Whether what is seen and heard comes so late that people may notice it: then no session begins
// unless the protocol accepts it.

#include <string>

#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/station/run_settings.h"

namespace palpate::runner::station {

/// Of frames, in the newest run of the database that has any.
/// \return a note for the record: the lag is accepted; empty: it is short, or unknown
/// \throws UsageError: the lag is too long, and the protocol does not accept it
std::string check_seen_lag(data::Store& store, const protocols::Protocol& protocol);

/// Of contacts: as measured at the sound card, or else in the newest run of the database.
/// \return, \throws as check_seen_lag
std::string check_sound_lag(data::Store& store, const protocols::Protocol& protocol,
                            const RunSettings& settings);

}  // namespace palpate::runner::station
