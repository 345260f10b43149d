#pragma once
// The tracks of a procedure over the trials, and what it made of its answers itself.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/task_trials.h"
#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {

/// An adaptive procedure at the end of a track.
struct TrackProcedure {
  protocols::ProcedureSpec spec;
  protocols::Estimate estimate;  ///< the procedure's own, from the answers that it was told
  /// Staircase: where it converges, as a share of successes, and the level of a fitted function at
  /// that share. Others have none.
  std::optional<double> target, fitted_level;
};

const char* kind_of(
    const protocols::ProcedureSpec& spec);  ///< as protocols say it: "staircase", ...

/// The scale on which an adaptive procedure has its levels; nullopt: it is none.
std::optional<protocols::LevelScale> scale_of_adaptive(const protocols::ProcedureSpec& spec);
/// The levels that an adaptive procedure has as easier; nullopt: it is none.
std::optional<protocols::Easier> easier_of_adaptive(const protocols::ProcedureSpec& spec);
/// How a trial's block chose its levels; nullptr: its protocol is not in the source.
const protocols::BlockProcedures* block_of(const TaskTrial& trial, const TaskTable& table);
/// The procedures of a trial's block; empty: none, or its protocol is not in the source.
const std::vector<protocols::ProcedureSpec>& specs_of(const TaskTrial& trial,
                                                      const TaskTable& table);

/// The trials of a track in order, those without an answer left out.
struct Track {
  std::string name;
  std::vector<double> levels;
  std::vector<bool> successes;
  /// Of a staircase: the answers at which it turned, as indices; with its protocol all that it
  /// counted itself. Without one they follow from levels and answers: empty where the levels do not
  /// follow the answers, and the last answer turned it if as many alike did before.
  std::vector<std::size_t> reversals;
  /// None: levels are constant, or the protocol is not in the source.
  std::optional<TrackProcedure> procedure;
};

/// Of the trials of a participant with a cell, the tracks of more than one trial.
std::vector<Track> tracks_of(const std::vector<const TaskTrial*>& trials, const TaskTable& table);
/// Sets fitted_level of staircases. \param fit  of the same trials
void add_fitted_levels(std::vector<Track>& tracks, const PsychometricModel& model,
                       const PsychometricFit& fit);

}  // namespace palpate::analysis
