#pragma once
// Blocks of tasks, groups and procedures in words: for `validate`, `schedule` and `register`.

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

/// "young, older: in turn by participant number"; "": no groups
std::string groups_in_words(const protocols::Protocol& protocol);

/// "staircase, 2 down 1 up, from 500 within 300 to 600, ..."
std::string in_words(const protocols::ProcedureSpec& procedure);
/// Contents of a block and the choice of its levels, in one or more lines, without indentation.
std::vector<std::string> in_words(const protocols::Protocol& protocol,
                                  const protocols::TaskBlock& block);

/// Parts of a protocol of version 2 that the eight buttons of a device cannot answer, so that a
/// session with --buttons needs a keyboard: "numbers of 'estimate'", ...
std::vector<std::string> keyboard_parts(const protocols::Protocol& protocol);

/// How well the procedures of a protocol find a known threshold, for `schedule --recover`.
/// A line for each procedure: its target, bias and spread over the simulated participants.
/// \param format  table, csv or json
std::string recovery_text(const protocols::Protocol& protocol, int participants, std::uint64_t seed,
                          const std::string& format);

}  // namespace palpate::runner::study
