#pragma once
// Why and how a live session ends before its last trial.

#include <stdexcept>
#include <string>

#include "data/record.h"

namespace palpate::runner {

/// The end of a session before its last trial; what() says why, for the record.
class EndOfSession : public std::runtime_error {
 public:
  EndOfSession(data::RunEnd how, const std::string& why, bool unwanted = false)
      : std::runtime_error(why), end(how), failed(unwanted) {}
  data::RunEnd end;
  bool failed;  ///< nobody wished it
};

/// What the experimenter's "quit" with these words means. That a participant withdraws is never
/// lost: any word that says so counts, in any case of letters.
EndOfSession end_by_experimenter(const std::string& words);

}  // namespace palpate::runner
