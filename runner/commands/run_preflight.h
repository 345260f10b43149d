#pragma once
// Pre-flight of a live session, at the console: with the servo, before anything is on record.

#include <string>
#include <vector>

#include "runner/commands/run_parts.h"

namespace palpate {

struct PreflightRecord {
  std::vector<std::string> findings;
  std::vector<std::string> messages;  ///< that the console has shown
};

/// \throws EndOfSession
PreflightRecord go_through_preflight(const RunParts& at);

}  // namespace palpate
