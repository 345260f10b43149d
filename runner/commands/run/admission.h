#pragma once
// Before a device is opened: who takes part, with which protocol; what is doubtful is asked.

#include <optional>
#include <string>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"

namespace palpate::runner {

struct RunSettings;

struct Admission {
  std::string participant;       ///< may be another one than was named
  std::optional<int> number;     ///< to be given; none: the next unused one
  data::ProtocolInfo enrolled;   ///< the protocol that the participant is, or will be, enrolled in
  protocols::Protocol protocol;  ///< to be shown; but for its texts the same
  std::vector<std::string> warnings;  ///< for the experimenter, also on the console
  std::vector<std::string> notes;     ///< JSON, for the record
};

/// Looks into the database, if there is one, and lets it go again. Asks at the terminal, where
/// there is one, before somebody new takes part, and with what somebody goes on whose protocol was
/// changed. \throws UsageError: the answer was no, or the options contradict the database;
/// InputError; StoreError.
Admission admit(const RunSettings& settings);

}  // namespace palpate::runner
