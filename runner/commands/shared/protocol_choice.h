#pragma once
// A participant who comes back to a protocol that was changed in between: with which is it to go
// on?

#include <cstddef>
#include <optional>
#include <string>

#include "data/store/store.h"
#include "protocols/difference.h"
#include "protocols/protocol.h"

namespace palpate::runner {

/// A participant's own protocol, where it is not, to the byte, the one that was named.
struct EarlierProtocol {
  data::ProtocolInfo info;
  std::string shown_sha256;  ///< of what the last run was shown with; "": of the participant's own
  std::size_t trials = 0;    ///< on record
  std::string last_run;      ///< "2026-11-21 15:02 UTC"; "" where there was none
};

/// The latest protocol of this name but another text that `code` is enrolled in.
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

/// Asked at the terminal, where there is one; otherwise the stored protocol, if the option says
/// nothing else. Says what differs. \throws UsageError: the option does not fit, or nothing is to
/// be done.
ProtocolChoice choose_protocol(const ChangedProtocol& changed);

/// What differed and what was chosen, for the record.
std::string to_json_text(const ChangedProtocol& changed, ProtocolChoice choice);

}  // namespace palpate::runner
