#pragma once
// The admission to a session, before a device is opened: the participant and the protocol, with
// questions about doubtful points.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "protocols/session_plan.h"
#include "runner/servo/device.h"
#include "runner/station/run_settings.h"

namespace palpate::runner::station {

/// Participant codes that are easily mistaken for each other.
/// The codes of `known` that `code` may stand for: spelt otherwise (P01, p01, P1, PO1), or one
/// letter away (PP01, SUJB01). Codes that differ only by digits are different participants: P01,
/// P02.
std::vector<std::string> near_codes(const std::string& code, const std::vector<std::string>& known);

/// The session that is due or was requested. \throws UsageError: none is due, the requested one
/// does not exist, or the participant has withdrawn.
int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings);

/// "yesterday 15:02", "today 09:30", "2026-01-31 15:02", in local time.
std::string spoken_time(std::int64_t utc_ns, std::int64_t now_utc_ns);

/// "12 of 24 trials done, last run yesterday 15:02 (paused), continues with trial 13". Empty if the
/// session was never begun.
std::string resumption(data::Store& store, const data::Participant& participant, int session,
                       const protocols::SessionPlan& plan);

/// The time of the withdrawal, in words; empty: none.
std::string withdrawn_when(data::Store& store, const std::string& code);

struct Admission {
  std::string participant;       ///< may differ from the named one
  std::optional<int> number;     ///< to be assigned; none: the next unused one
  data::ProtocolInfo enrolled;   ///< the protocol that the participant is, or will be, enrolled in
  protocols::Protocol protocol;  ///< to be shown: the group's own; else the same but for texts
  std::size_t group = 0;         ///< index, where the protocol has groups
  protocols::Protocol of_all;    ///< the same for all groups, of which `protocol` is one
  data::ProtocolInfo shown;      ///< that protocol, with the files of all groups
  std::vector<std::string> warnings;  ///< for the experimenter, also on the console
  std::vector<std::string> notes;     ///< JSON, for the record
};

/// Reads the database, if there is one, and closes it. Asks at the terminal, if there is one,
/// before a new participant takes part, and which protocol to use after a change. \throws
/// UsageError: the answer was no, or the options contradict the database; InputError; StoreError.
Admission admit(const RunSettings& settings);

/// This moment on the session clock and in UTC.
data::ClockStamp stamp_now(servo::Clock& clock);

/// The record of a run as a whole.
/// \param joystick  whether the protocol maps one, and a window looks at it
data::RunInfo run_info(const RunSettings& settings, const servo::DeviceCapabilities& device,
                       int session, const data::ClockStamp& began, bool joystick);

/// The protocol as shown, if its texts differ from those of the participant's protocol.
std::optional<data::ProtocolInfo> other_texts(const Admission& admission);

}  // namespace palpate::runner::station
