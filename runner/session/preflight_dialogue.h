#pragma once
// The pre-flight of a live session at the console: the servo runs, the experimenter goes through
// the checklist, and no trial has begun.

#include <string>
#include <vector>

#include "runner/session/preflight.h"
#include "runner/session/station.h"

namespace palpate::runner {

struct PreflightResult {
  std::vector<std::string> findings;  ///< what was checked and what was left out, for the record
  std::vector<std::string> messages;  ///< that the console has shown
};

/// Until every step is done or left out and forces are allowed. For the session's own thread.
/// \param news  messages that the console shows first
/// \throws EndOfSession
PreflightResult run_preflight(const LiveStation& station, const std::vector<std::string>& news);

}  // namespace palpate::runner
