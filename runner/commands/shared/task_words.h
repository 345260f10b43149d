#pragma once
// A block of tasks in words, and a run of a session with answers by chance: for `validate` and
// `schedule`.

#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/tasks/task_plan.h"

namespace palpate::runner {

/// "staircase, 2 down 1 up, from 500 within 300 to 600, ..."
std::string in_words(const protocols::ProcedureSpec& procedure);
/// What a block shows and how its levels come: a line or several, without indentation.
std::vector<std::string> in_words(const protocols::Protocol& protocol,
                                  const protocols::TaskBlock& block);

/// All trials of a participant. Those of adaptive blocks depend on the answers: they are given by a
/// participant whose threshold is in the middle of the levels.
std::vector<protocols::Trial> example_trials(const protocols::Protocol& protocol, int participant);

/// What of a protocol of version 2 the eight buttons of a device cannot answer, so that a session
/// with --buttons needs a keyboard: "numbers of 'estimate'", ...
std::vector<std::string> keyboard_parts(const protocols::Protocol& protocol);

/// Position of what was compared with the standard, from 1; 0: none.
int comparison_interval(const protocols::TaskBlock& block, const protocols::Trial& trial);

}  // namespace palpate::runner
