#pragma once
// Early ends of a session or of a trial.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "data/record.h"
#include "runner/servo/device.h"

namespace palpate::runner::session {

/// The end of a session before its last trial; what() says why, for the record.
class EndOfSession : public std::runtime_error {
 public:
  EndOfSession(data::RunEnd how, const std::string& why, bool by_fault = false)
      : std::runtime_error(why), end(how), failed(by_fault) {}
  data::RunEnd end;
  bool failed;  ///< ended by a signal or fault
};

/// How the session ends after ":quit WORDS" from the experimenter. Any form of "withdraw" among the
/// words, in upper or lower case, records a withdrawal.
EndOfSession end_by_experimenter(const std::string& words);

/// A trial could not continue: the device was lost or forces went off. The attempt is recorded as
/// cut off, forces are zero.
class SessionFault : public std::runtime_error {
 public:
  SessionFault(const std::string& what, std::string why, std::uint32_t bits,
               servo::DeviceTrouble device)
      : std::runtime_error(what), reason(std::move(why)), faults(bits), trouble(device) {}
  /// Whether the fault ends by itself: the machine was late, device and stylus are well.
  bool is_transient() const;
  std::string reason;    ///< of the forces going off
  std::uint32_t faults;  ///< of the tick
  servo::DeviceTrouble trouble;
};

/// The reason that forces went off, in words. \param faults, trouble  of a sample with kTripped
std::string trip_reason(std::uint32_t faults, servo::DeviceTrouble trouble);

}  // namespace palpate::runner::session
