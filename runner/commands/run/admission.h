#pragma once
// Before a device is opened: who takes part, with which protocol; what is doubtful is asked.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/commands/run/settings.h"
#include "runner/servo/device.h"
#include "runner/session/session_plan.h"

namespace palpate::runner {

// Which session is due, where it goes on, and whether its participant has withdrawn.

/// The session that is due, or was asked for. \throws UsageError: none is due, the one asked for
/// does not exist, or the participant has withdrawn.
int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings);

/// "yesterday 15:02", "today 09:30", "2026-01-31 15:02", in local time.
std::string spoken_time(std::int64_t utc_ns, std::int64_t now_utc_ns);

/// "12 of 24 trials done, last run yesterday 15:02 (paused), continues with trial 13". Empty where
/// the session was never begun.
std::string resumption(data::Store& store, const data::Participant& participant, int session,
                       const SessionPlan& plan);

/// Has the newest run of somebody with this code ended with a withdrawal, in whatever protocol?
/// \throws UsageError: it has
void refuse_withdrawn(data::Store& store, const std::string& code);

/// \param when  in words; empty: not said
[[noreturn]] void throw_withdrawn(const std::string& code, const std::string& when);

/// When that was; empty: it has not.
std::string withdrawn_when(data::Store& store, const std::string& code);

struct RunSettings;

struct Admission {
  std::string participant;       ///< may be another one than was named
  std::optional<int> number;     ///< to be given; none: the next unused one
  data::ProtocolInfo enrolled;   ///< the protocol that the participant is, or will be, enrolled in
  protocols::Protocol protocol;  ///< to be shown; but for its texts the same
  std::vector<std::string> warnings;  ///< for the experimenter, also on the console
  std::vector<std::string> notes;     ///< JSON, for the record
};

/// Looks into the database, if there is one, and lets it go again. Asks at the terminal, where
/// there is one, before somebody new takes part, and with what somebody goes on whose protocol was
/// changed. \throws UsageError: the answer was no, or the options contradict the database;
/// InputError; StoreError.
Admission admit(const RunSettings& settings);

// What goes on record of a run as a whole.

/// This moment on the session clock and in UTC.
data::ClockStamp stamp_now(Clock& clock);

/// \param joystick  whether the protocol maps one, and a window looks at it
data::RunInfo run_info(const RunSettings& settings, const DeviceCapabilities& device, int session,
                       const data::ClockStamp& began, bool joystick);

/// The protocol as shown, where its texts are not those of the one that the participant is enrolled
/// in.
std::optional<data::ProtocolInfo> other_texts(const Admission& admission);

}  // namespace palpate::runner
