#pragma once
// One session of one simulated participant: the trial loop, servo and renderers of a live session
// with a virtual clock. simulate_study() stores what it gives, a sweep keeps figures of it alone.

#include <atomic>
#include <cstdint>
#include <functional>

#include "data/record.h"
#include "protocols/protocol.h"
#include "runner/participants/simulated.h"
#include "runner/participants/task_participant.h"
#include "runner/scene_builder.h"
#include "runner/session/level_advisor.h"
#include "runner/session/session_plan.h"
#include "runner/session/trial_log.h"

namespace palpate::runner {

/// What the sessions of a study share, read only.
struct SimulatedStudy {
  /// \throws std::invalid_argument naming what the simulated device or participant cannot do.
  /// \param protocol, settings  must outlive it
  SimulatedStudy(const protocols::Protocol& protocol, const SimulatedSettings& settings,
                 std::uint64_t seed);

  const protocols::Protocol& protocol;
  const SimulatedSettings& settings;
  StimulusLibrary library;
  ShapeHypotheses hypotheses;
  BlockHypotheses of_blocks;  ///< version 2
  std::uint64_t seed;         ///< of the participants; the schedule has the protocol's own
};

struct SimulatedSession {
  int participant = 1;  ///< number
  SessionPlan plan;
  std::int64_t clock_ns = 0;  ///< where its clock stands
  data::ClockStamp utc;
  LevelAdvisor* advisor = nullptr;
};

/// \param halting  asked between trials; one that was shown is finished
void run_simulated_session(const SimulatedStudy& study, const SimulatedSession& session,
                           TrialLog& log, const std::function<bool()>& halting);

/// What is on record of a session of a simulated participant before its first trial. Its clock is
/// that of a day of its own, from nine in the morning.
data::RunInfo simulated_run(const protocols::Protocol& protocol, const SimulatedSettings& settings,
                            int participant, int session);

/// A whole study that is stored nowhere: participants from 1, their sessions in order, in this
/// thread. \param visit  number of the participant, a trial, its ticks with contact. \return false:
/// it was stopped before its end. \throws as SimulatedStudy
bool simulate_in_memory(
    const protocols::Protocol& protocol, const SimulatedSettings& settings, int participants,
    std::uint64_t seed, const std::atomic<bool>& stop,
    const std::function<void(int, const data::TrialRecord&, std::uint64_t)>& visit);

}  // namespace palpate::runner
