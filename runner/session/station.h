#pragma once
// What a session works with, part by part. The `run` command opens a live station and
// simulate_study() a simulated one; whoever opens it owns its parts until the session is over.

#include <cstdint>
#include <functional>

#include "data/record.h"
#include "protocols/protocol.h"
#include "runner/participants/keyboard.h"
#include "runner/safety/guarded_device.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/device_check.h"
#include "runner/session/markers.h"
#include "runner/session/run_record.h"
#include "runner/session/session_plan.h"
#include "runner/session/socket_advisor.h"
#include "runner/sound/masking_noise.h"

namespace palpate::runner {

/// Of every session, simulated or live.
struct Station {
  const protocols::Protocol& protocol;  ///< its materials limited to what the device can show
  const StimulusLibrary& library;  ///< the protocol's stimuli at all levels, as convex meshes, m
  SessionPlan plan;      ///< the schedule, at the first trial that is not on record when it begins
  TickSource& servo;     ///< the servo loop: one sample a tick. Live: the servo thread
  Clock& clock;          ///< session clock, ns: of ticks, keys, markers. Simulated: virtual
  data::ClockStamp utc;  ///< one moment on the session clock and in UTC
  TrialLog& log;         ///< takes every trial before the next one begins. Live: the run record
  LevelAdvisor* advisor = nullptr;  ///< proposes levels of adaptive blocks; none: nobody does
};

/// ns, of the session's thread between two looks at console, device and participant.
inline constexpr std::int64_t kSessionNap_ns = 5'000'000;

/// Of a live session: a person, a device, two displays. Threads and processes of their own have the
/// servo, the watchdog, the displays, the markers and the noise; all else is the session thread's.
struct LiveStation : Station {
  RunRecord& record;                 ///< who takes part, in which session; its notes and trials
  const DeviceCapabilities& device;  ///< of the device that is open
  GuardedDevice* guard;              ///< its watchdog; none without force feedback
  ServoThread& servo_thread;
  /// Felt in the pre-flight; none without force feedback. Outlives the servo thread.
  const ForceDirectionCheck* direction_check;
  std::function<int()> end_requested;  ///< the signal that asked the program to end; 0: none has
  ParticipantScreen& screen;
  ExperimenterConsole& console;
  AnswerBy answer_by;
  Markers& markers;    ///< for other recordings: EEG, motion capture
  NoisePlayer* noise;  ///< noise and tones in the participant's headphones; none: not wanted
};

/// The radius about the origin that holds each of the library's stimuli in any orientation, m.
double largest_reach(const Station& station);

}  // namespace palpate::runner
