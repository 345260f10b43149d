#pragma once
// Why and how a live session ends before its last trial.

#include <stdexcept>
#include <string>

#include "data/record.h"

namespace palpate::runner {

/// The end of a session before its last trial; what() says why, for the record.
class EndOfSession : public std::runtime_error {
 public:
  EndOfSession(data::RunEnd how, const std::string& why, bool by_fault = false)
      : std::runtime_error(why), end(how), failed(by_fault) {}
  data::RunEnd end;
  bool failed;  ///< ended by a signal or fault
};

/// What the experimenter's "quit" with these words means. Any form of "withdraw" among them, in
/// upper or lower case, records a withdrawal.
EndOfSession end_by_experimenter(const std::string& words);

}  // namespace palpate::runner
