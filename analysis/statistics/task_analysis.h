#pragma once
// What was found with each task of a study of version 2, by block, stimulus and renderer.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/task_trials.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/discrimination.h"
#include "analysis/statistics/mixed_logistic.h"
#include "analysis/statistics/psychometric_fit.h"
#include "analysis/statistics/scaling.h"
#include "analysis/statistics/task_comparisons.h"

namespace palpate::analysis {

/// Information that answers transmit about stimuli, bit (Garner & Hake 1951).
struct InformationTransfer {
  std::string undefined;
  std::size_t trials = 0;
  double stimulus_entropy = 0;  ///< plain: what perfect identification would transmit
  std::optional<double> plain;  ///< of the observed shares; too large with few trials
  /// Less the bias to first order, (cells - rows - columns + 1) / (2 n ln 2), with the cells, rows
  /// and columns in which there are trials (Miller 1955, Miller-Madow); at most the stimulus
  /// entropy. May be below 0 where there is no information.
  std::optional<double> corrected;
  /// 2^corrected, at least 1: as many categories, identified without error, transmit as much.
  std::optional<double> categories;
  std::optional<double> se;  ///< jackknife over trials, of the plain figure
};

/// \param counts  [stimulus][answer]; trials without an answer are no part of it
InformationTransfer information_transfer(const std::vector<std::vector<std::size_t>>& counts);

// The tracks of a procedure over the trials, and what it made of its answers itself.

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

/// Which psychometric functions are fitted, and how their goodness of fit is judged.
struct FunctionSettings {
  protocols::PsychometricShape shape = protocols::PsychometricShape::logistic;
  /// Of the levels; Weibull functions: not linear. None: log10 of Weibull functions, of blocks
  /// whose adaptive procedures have a logarithmic scale, and of constant levels (or of unknown
  /// procedures) that are at least three and equally spaced by their ratios; else linear.
  std::optional<protocols::LevelScale> scale;
  int simulations = 199;  ///< of each goodness of fit; 0: without p
  std::uint64_t seed = 2026;
};

/// What is read off a participant's function, whatever its task measures. PSE: of two intervals
/// with levels on both sides of the standard. JND there: half the distance of the levels of 25 and
/// 75 %; of a forced choice the threshold's distance from the standard. Weber fraction: JND /
/// standard.
struct LevelFigures {
  std::optional<double> pse, jnd, weber_fraction;
  std::optional<Interval> pse_ci95, jnd_ci95, weber_fraction_ci95;
};

/// A psychometric function of a participant.
struct ParticipantFunction {
  std::string participant;
  std::vector<LevelCount> counts;  ///< by level
  PsychometricModel model;
  PsychometricFit fit;
  GoodnessOfFit goodness;
  /// Answers go the other way round than the task, or the other participants', say, by more than
  /// chance explains: twice the log likelihood of the better direction exceeds that of the expected
  /// one by the 0.95 quantile of chi squared with one degree of freedom. The fit is of the
  /// direction that they have.
  bool reversed = false;
  /// The threshold lies among the levels shown, its interval is closed, and the function is not
  /// reversed. Others are reported, but neither compared nor averaged.
  bool determined = false;
  LevelFigures figures;
  PsychometricPosterior posterior;  ///< of the same counts and model
  std::vector<Track> tracks;        ///< of more than one trial
  Detectability detectability;      ///< detect and same/different with catch trials; else undefined
};

/// All trials of one task with a stimulus and a renderer in a block.
struct TaskCell {
  std::string task, block_name, shape, renderer;
  std::size_t trials = 0, answered = 0;
  std::size_t judged = 0, correct = 0;  ///< trials whose answer can be right or wrong; right ones
  std::optional<double> standard_level;
  /// compare: 1 / `intervals` of the answers succeed without a difference: all levels lie on one
  /// side of the standard.
  bool forced_choice = false;
  bool same_different = false;  ///< compare: that is what is answered
  int intervals = 2;            ///< compare
  protocols::LevelScale scale = protocols::LevelScale::linear;  ///< of its functions
  /// Which levels have more successes, as the task says; none: nothing tells, and most
  /// participants' answers are taken as right.
  std::optional<protocols::Easier> expected_easier;
  std::string level_unit;                 ///< "N/m", ...; "": unknown, or without unit
  std::string no_function;                ///< why no psychometric function is fitted; empty: one is
  std::vector<std::string> participants;  ///< that `magnitude`, `adjustments` number
  std::vector<ParticipantFunction> functions;      ///< compare, detect
  std::optional<MagnitudeEstimation> magnitude;    ///< rate
  std::vector<Adjustment> adjustments;             ///< adjust
  std::optional<InformationTransfer> information;  ///< identify: over all its stimuli, pooled
  std::vector<InformationTransfer> informations;   ///< of each participant
  /// Mean of the participants' corrected bits, and its t interval.
  std::optional<double> information_mean;
  std::optional<Interval> information_ci95;
  Type2Roc confidence;  ///< undefined: nobody was asked
};

struct TaskAnalysis {
  TaskTable table;
  FunctionSettings functions;
  std::vector<TaskCell> cells;
  std::vector<TaskGroup> groups;
  std::vector<TaskComparison> renderers, conditions;
  /// What version 1 reports of identification, over all its blocks; none: no identification.
  std::optional<Analysis> identification;
  std::optional<MixedLogistic> accuracy;  ///< likewise
};

/// \param settings, program_version  of the analysis of identification
TaskAnalysis analyze_tasks(TaskTable table, const FunctionSettings& functions,
                           const AnalysisSettings& settings = {},
                           const std::string& program_version = {});

}  // namespace palpate::analysis
