#pragma once
// Before a device moves: who is to take part, and is that meant?

#include <string>
#include <vector>

namespace palpate {

struct RunSettings;
struct Protocol;

/// What the checks found that goes on record with the run.
struct Admission {
  std::vector<std::string> warnings;  ///< for the experimenter, also on the console
  std::vector<std::string> notes;     ///< JSON
};

/// Looks into the database, if there is one, and lets it go again. Asks at the terminal, where
/// there is one, before somebody new takes part. \throws UsageError: not meant, or told otherwise
/// than it is; StoreError.
Admission admit(const RunSettings& settings, const Protocol& protocol);

}  // namespace palpate
