#pragma once
// A station has the parts that a session works with. The `run` command opens a live station and
// simulate_study() a simulated one; the opener owns the parts until the session is over.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "data/record.h"
#include "protocols/protocol.h"
#include "protocols/session_plan.h"
#include "runner/participants/keyboard.h"
#include "runner/safety/guarded_device.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/device_check.h"
#include "runner/session/markers.h"
#include "runner/session/run_record.h"
#include "runner/session/socket_advisor.h"
#include "runner/session/trial_log.h"
#include "runner/sound/player.h"

namespace palpate::runner::session {

/// The parts of every session, simulated or live.
struct Station {
  const protocols::Protocol& protocol;  ///< its materials limited to the device
  const StimulusLibrary& library;  ///< the protocol's stimuli at all levels, as convex meshes, m
  protocols::SessionPlan plan;     ///< the schedule, initially at the first unrecorded trial
  servo::TickSource& servo;        ///< the servo loop: one sample a tick. Live: the servo thread
  servo::Clock& clock;   ///< session clock, ns: of ticks, keys, markers. Simulated: virtual
  data::ClockStamp utc;  ///< one moment on the session clock and in UTC
  TrialLog& log;         ///< records every trial before the next one begins. Live: the run record
  LevelAdvisor* advisor = nullptr;      ///< proposes levels of adaptive blocks; may be null
  sound::SoundPlayer* sound = nullptr;  ///< what the participant hears; null: nothing
};

/// ns, between two polls of console, device and participant by the session's thread.
inline constexpr std::int64_t kSessionNap_ns = 5'000'000;

/// The parts of a live session: a person, a device, two displays. The servo, the watchdog, the
/// displays, the markers and the sound have threads or processes of their own; all else belongs to
/// the session's thread.
struct LiveStation : Station {
  RunRecord& record;                        ///< participant, session, notes and trials
  const servo::DeviceCapabilities& device;  ///< of the open device
  safety::GuardedDevice* guard;             ///< its watchdog; null without force feedback
  servo::ServoThread& servo_thread;
  /// Felt in the pre-flight; null without force feedback. Outlives the servo thread.
  const ForceDirectionCheck* direction_check;
  std::function<int()> end_requested;  ///< the signal that asked the program to end; 0: none
  display::ParticipantScreen& screen;
  display::ExperimenterConsole& console;
  participants::AnswerBy answer_by;
  Markers& markers;  ///< for other recordings: EEG, motion capture
};

/// m, the radius about the origin that holds every stimulus of the library in any orientation.
inline double largest_reach(const Station& station) {
  double reach = 0;
  for (std::size_t i = 0; i < station.library.size(); ++i)
    reach = std::max(reach, station.library.reach(static_cast<int>(i)));
  return reach;
}

}  // namespace palpate::runner::session
