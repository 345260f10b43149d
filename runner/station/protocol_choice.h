#pragma once
// Chooses the version of the protocol when a participant returns after the file was edited.

#include <cstddef>
#include <optional>
#include <string>

#include "data/store/store.h"
#include "protocols/difference.h"
#include "protocols/protocol.h"

namespace palpate::runner::station {

/// The protocol that a participant began with, if it differs from the named one.
struct EarlierProtocol {
  data::ProtocolInfo info;
  std::string shown_sha256;  ///< of the version shown in the last run; "": the participant's own
  std::size_t trials = 0;    ///< on record
  std::string last_run;      ///< "2026-11-21 15:02 UTC"; "": there was none
};

/// The latest protocol of this name with a different text in which `code` is enrolled.
std::optional<EarlierProtocol> earlier_protocol(data::Store& store,
                                                const protocols::Protocol& protocol,
                                                const std::string& code);

enum class ProtocolChoice { stored, new_texts, new_code };

struct ChangedProtocol {
  const EarlierProtocol& earlier;
  const protocols::Protocol& now;
  std::string path;    ///< of `now`
  std::string code;    ///< of the participant
  std::string option;  ///< --changed-protocol; "": not given
};

/// Chooses by the option, else by asking on a terminal, else the stored protocol. Prints the
/// differences. \throws UsageError if the option is impossible or the user quits.
ProtocolChoice choose_protocol(const ChangedProtocol& changed);

/// The differences and the choice, for the record.
std::string to_json_text(const ChangedProtocol& changed, ProtocolChoice choice);

}  // namespace palpate::runner::station
