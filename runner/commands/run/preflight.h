#pragma once
// Pre-flight of a live session, at the console: with the servo, before there are trials.

#include <string>
#include <vector>

#include "runner/commands/run/parts.h"

namespace palpate::runner {

struct PreflightRecord {
  std::vector<std::string> findings;
  std::vector<std::string> messages;  ///< that the console has shown
};

/// \param record     takes the experimenter's notes
/// \param news       shown first
/// \throws EndOfSession
PreflightRecord go_through_preflight(const RunParts& at, RunRecord& record,
                                     const std::vector<std::string>& news);

}  // namespace palpate::runner
