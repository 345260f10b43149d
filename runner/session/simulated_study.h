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
#include "protocols/session_plan.h"
#include "runner/participants/simulated.h"
#include "runner/participants/simulated_settings.h"
#include "runner/participants/task_participant.h"
#include "runner/scene_builder.h"
#include "runner/session/socket_advisor.h"
#include "runner/session/trial_log.h"

namespace palpate::runner::session {

/// Data that the sessions of a study share, read only.
struct SimulatedStudy {
  /// \throws std::invalid_argument naming the demands that the simulated device or participant
  /// cannot meet.
  /// \param protocol, settings  must outlive it
  SimulatedStudy(const protocols::Protocol& protocol,
                 const participants::SimulatedSettings& settings, std::uint64_t seed);

  const protocols::Protocol& protocol;
  const participants::SimulatedSettings& settings;
  StimulusLibrary library;
  participants::ShapeHypotheses hypotheses;  ///< of a hand that explores and asks for no shape
  participants::BlockHypotheses of_blocks;
  std::uint64_t seed;  ///< of the participants; the schedule has the protocol's own
  participants::JudgementOf planned =
      {};  ///< of blocks of tasks: as a plan says; empty: from what is felt
};

struct SimulatedSession {
  int participant = 1;  ///< number
  protocols::SessionPlan plan;
  std::int64_t clock_ns = 0;  ///< start of its clock
  data::ClockStamp utc;
  LevelAdvisor* advisor = nullptr;
  std::vector<data::TrialRecord> completed = {};  ///< in earlier runs; only of a task that learns
};

/// One session of one simulated participant: the trial loop, servo and renderers of a live session
/// with a virtual clock. simulate_study() stores its records; a sweep keeps only summary figures.
/// \param halting  asked between trials; a shown trial is finished
void run_simulated_session(const SimulatedStudy& study, const SimulatedSession& session,
                           TrialLog& log, const std::function<bool()>& halting);

/// The run record of a simulated participant's session before its first trial. Its clock begins at
/// nine in the morning of a day of its own.
data::RunInfo simulated_run(const protocols::Protocol& protocol,
                            const participants::SimulatedSettings& settings, int participant,
                            int session);

/// Simulates a whole study without storing it: participants of these numbers, their sessions in
/// order, in this thread. \param visit  gets the participant's number, a trial and its ticks with
/// contact. \return false: stopped before its end. \throws as SimulatedStudy
bool simulate_in_memory(
    const protocols::Protocol& protocol, const participants::SimulatedSettings& settings,
    const std::vector<int>& numbers, std::uint64_t seed, const std::atomic<bool>& stop,
    const std::function<void(int, const data::TrialRecord&, std::uint64_t)>& visit,
    const participants::JudgementOf& planned = {});

/// 1, 2, ... of so many participants.
std::vector<int> first_numbers(int participants);

struct StudyPlan {
  std::vector<int> numbers = {};  ///< of the participants, in order
  std::uint64_t seed = 1;         ///< of the participants; the schedule has the protocol's own
  int jobs = 1;                   ///< threads
  std::string event = {};         ///< for each session's record; empty: none
  std::string advisor = {};       ///< socket of a program that proposes levels; empty: none
  double advisor_time_out = 1;    ///< s
  participants::JudgementOf planned = {};  ///< as of SimulatedStudy
};

struct StudyProgress {
  std::int64_t recorded = 0;     ///< trials in the store, earlier runs included
  std::int64_t expected = 0;     ///< in all, as far as known
  std::int64_t this_run = 0;     ///< recorded since this call
  double simulated_seconds = 0;  ///< of session time since this call
  struct Answers {
    std::int64_t trials = 0, unanswered = 0;
  };
  std::map<std::string, Answers> by_block = {};  ///< since this call
};

struct LimitedForSimulation {
  std::vector<std::string> texts;  ///< a sentence for each limited material
  std::string event;               ///< for StudyPlan::event; empty: no material was limited
};
/// Scales the protocol's materials down to the limits of the simulated device, where the protocol
/// asks for that (servo.material_limit).
LimitedForSimulation limit_for_simulation(protocols::Protocol& protocol,
                                          const participants::SimulatedSettings& settings);

/// The reasons that the simulated device or participant cannot run a protocol, a sentence each;
/// empty: they can.
std::vector<std::string> simulation_faults(const protocols::Protocol& protocol,
                                           const StimulusLibrary& library,
                                           const participants::SimulatedSettings& settings);

/// Runs the trials that have no record yet. The same seed gives the same records for any number of
/// jobs and interruptions: each trial has a random stream, each session a virtual clock and
/// calendar of its own, and an unrecorded trial is run again as if for the first time.
/// \param stop  set from outside (a signal): the current trials are finished and recorded
/// \param report  called every 0.2 s or so
/// \throws std::invalid_argument: the simulated device or participant cannot run the protocol;
/// StoreError
StudyProgress simulate_study(const protocols::Protocol& protocol, data::Store& store,
                             const participants::SimulatedSettings& settings, const StudyPlan& plan,
                             const std::atomic<bool>& stop,
                             const std::function<void(const StudyProgress&)>& report);

/// "S001": the code of simulated participant 1.
std::string simulated_code(int number);

}  // namespace palpate::runner::session
