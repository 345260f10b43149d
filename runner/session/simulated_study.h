#pragma once
// A whole study with simulated participants, several sessions in parallel, through the same trial
// loop, servo, renderers and store as a live one.

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "data/record.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/participants/simulated.h"
#include "runner/participants/simulated_settings.h"
#include "runner/participants/task_participant.h"
#include "runner/scene_builder.h"
#include "runner/session/run_record.h"
#include "runner/session/session_plan.h"
#include "runner/session/socket_advisor.h"

namespace palpate::runner {

// One session of one simulated participant: the trial loop, servo and renderers of a live session
// with a virtual clock. simulate_study() stores what it gives, a sweep keeps figures of it alone.

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

struct StudyPlan {
  int participants = 7;         ///< the number of the last one
  int before = 0;               ///< the number before that of the first one
  std::uint64_t seed = 1;       ///< of the participants; the schedule has the protocol's own
  int jobs = 1;                 ///< threads
  std::string event = {};       ///< for each session's record; empty: none
  std::string advisor = {};     ///< socket of a program that proposes levels; empty: none
  double advisor_time_out = 1;  ///< s
};

struct StudyProgress {
  std::int64_t recorded = 0;     ///< trials in the store, earlier runs included
  std::int64_t expected = 0;     ///< in all, as far as is known
  std::int64_t this_run = 0;     ///< recorded since this call
  double simulated_seconds = 0;  ///< of session time since this call
  struct Answers {
    std::int64_t trials = 0, unanswered = 0;
  };
  std::map<std::string, Answers> by_block = {};  ///< version 2: since this call
};

struct LimitedForSimulation {
  std::vector<std::string> texts;  ///< a sentence for each material that was scaled down
  std::string event;               ///< for StudyPlan::event; empty: none was
};
/// Scales the protocol's materials down to what the simulated device can show, where the protocol
/// asks for that (servo.material_limit).
LimitedForSimulation limit_for_simulation(protocols::Protocol& protocol,
                                          const SimulatedSettings& settings);

/// The stimuli as the observer's hypotheses need them.
std::vector<stimuli::ObjectSpec> shapes_of(const protocols::Protocol& protocol);

/// Why the simulated device or participant cannot do a protocol, a sentence each; empty: they can.
std::vector<std::string> simulation_faults(const protocols::Protocol& protocol,
                                           const StimulusLibrary& library,
                                           const SimulatedSettings& settings);

/// Runs what has no record yet. The same seed gives the same records whatever the number of jobs
/// and of interruptions: each trial has a random stream, each session a virtual clock and calendar
/// of its own, and a trial that was not recorded is run again as if for the first time. \param stop
/// set from outside (a signal): the trials under way are finished and recorded \param report called
/// every 0.2 s or so \throws std::invalid_argument where the simulated device or participant cannot
/// do the protocol; StoreError
StudyProgress simulate_study(const protocols::Protocol& protocol, data::Store& store,
                             const SimulatedSettings& settings, const StudyPlan& plan,
                             const std::atomic<bool>& stop,
                             const std::function<void(const StudyProgress&)>& report);

/// "S001": the code of simulated participant 1.
std::string simulated_code(int number);

}  // namespace palpate::runner
