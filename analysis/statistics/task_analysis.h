#pragma once
// The analysis of a study: of each task by block, stimulus and renderer, and of identification.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/study_table.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/answer_model.h"
#include "analysis/statistics/discrimination.h"
#include "analysis/statistics/field_analysis.h"
#include "analysis/statistics/mixed_model.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/psychometric_fit.h"
#include "analysis/statistics/ratings.h"
#include "analysis/statistics/reaching.h"
#include "analysis/statistics/study_design.h"
#include "analysis/statistics/task_comparisons.h"
#include "analysis/statistics/task_group.h"
#include "analysis/statistics/transformed_means.h"

namespace palpate::analysis {

/// One judgement of a participant in magnitude estimation.
struct MagnitudeTrial {
  std::size_t participant = 0;
  double level = 0;      ///< of the stimulus, > 0
  double magnitude = 0;  ///< as judged, > 0; others have no logarithm and are only counted
};

/// Straight line of log10 magnitude over log10 level (Stevens 1957), by least squares on the log
/// means of each level.
struct StevensLine {
  /// Geometric mean of the magnitudes at a level.
  struct Point {
    double level = 0, magnitude = 0;
  };

  std::string undefined;
  std::size_t participant = 0;
  std::size_t trials = 0, levels = 0;
  std::optional<double> exponent, log10_scale;  ///< magnitude = 10^log10_scale level^exponent
  std::optional<double> r_squared;
  std::optional<double> exponent_se;  ///< from three levels on
  std::vector<Point> points;          ///< in order of the level, as judged
};

/// Geometric mean of the magnitudes at a level over participants, after equalising their means of
/// logs (Stevens' "modulus equalization"), or untransformed with a modulus given by the
/// experimenter.
struct MagnitudeMean {
  double level = 0;
  double geometric_mean = 0;
  std::optional<Interval> ci95;  ///< t over participants
  std::size_t participants = 0;
};

struct MagnitudeEstimation {
  std::vector<StevensLine> lines;  ///< one per participant, in their order
  std::vector<MagnitudeMean> means;
  std::size_t without_logarithm = 0;
  /// Mean of the participants' exponents and its 95 % interval (t).
  std::optional<double> exponent;
  std::optional<Interval> exponent_ci95;
};

/// \param modulus  the experimenter gave the number of a standard
MagnitudeEstimation magnitude_estimation(const std::vector<MagnitudeTrial>& trials, bool modulus);

/// One setting of a level to equal a standard, by the method of adjustment.
struct AdjustmentTrial {
  std::size_t participant = 0;
  double standard = 0, setting = 0;
  bool from_above = false;
};

/// Summary of a participant's settings.
struct Adjustment {
  std::size_t participant = 0;
  std::size_t settings = 0;
  double pse = 0;                      ///< mean setting
  std::optional<Interval> pse_ci95;    ///< t; not below 0 if all settings are above 0
  double constant_error = 0;           ///< PSE minus standard
  std::optional<double> sd;            ///< of the settings about the mean of their direction
  std::optional<double> jnd;           ///< 0.6745 sd: half of the settings lie within
  std::optional<double> start_effect;  ///< mean setting from above minus from below
};

/// By participant, in their order; settings of one standard.
std::vector<Adjustment> adjustments(const std::vector<AdjustmentTrial>& trials);

/// Information that answers transmit about stimuli, bit (Garner & Hake 1951).
struct InformationTransfer {
  std::string undefined;
  std::size_t trials = 0;
  double stimulus_entropy = 0;  ///< that of perfect identification, uncorrected
  std::optional<double> plain;  ///< from observed shares; too large with few trials
  /// Minus the bias to first order, (cells - rows - columns + 1) / (2 n ln 2), counting cells, rows
  /// and columns with trials (Miller 1955, Miller-Madow); at most the stimulus entropy. May be
  /// below 0 without information.
  std::optional<double> corrected;
  /// 2^corrected, at least 1: the number of categories that, identified without error, transmit as
  /// much.
  std::optional<double> categories;
  std::optional<double> se;  ///< jackknife over trials, of the plain figure
};

/// \param counts  [stimulus][answer]; excludes trials without an answer
InformationTransfer information_transfer(const std::vector<std::vector<std::size_t>>& counts);

/// An adaptive procedure at the end of a track.
struct TrackProcedure {
  protocols::ProcedureSpec spec;
  protocols::Estimate estimate;  ///< the procedure's own, from its answers
  /// Staircase: the share of successes to which it converges, and the level of a fitted function at
  /// that share. None for others.
  std::optional<double> target, fitted_level;
};

/// The trials of a track in order, those without an answer left out.
struct Track {
  std::string name;
  std::vector<double> levels;
  std::vector<bool> successes;
  /// Indices of the answers at which a staircase reversed; with the protocol, as it counted them.
  /// Without, they follow from levels and answers: empty if the levels do not follow the answers;
  /// the last answer reversed it if equally many like answers did before.
  std::vector<std::size_t> reversals;
  /// None: levels are constant, or the source has no protocol.
  std::optional<TrackProcedure> procedure;
};

/// The tracks with more than one trial among a participant's trials in a cell.
std::vector<Track> tracks_of(const std::vector<const StudyTrial*>& trials, const StudyTable& table);

/// Settings of psychometric functions, their goodness of fit and what else is made of answers.
struct FunctionSettings {
  protocols::PsychometricShape shape = protocols::PsychometricShape::logistic;
  /// Of the levels; Weibull functions: not linear. None: log10 of Weibull functions, of blocks
  /// whose adaptive procedures have a logarithmic scale, and of constant levels (or of unknown
  /// procedures) that are at least three and equally spaced by their ratios; else linear.
  std::optional<protocols::LevelScale> scale;
  int simulations = 199;  ///< of each goodness of fit; 0: without p
  std::uint64_t seed = 2026;
  std::optional<AnswerModelSettings> answer_model;  ///< none: without a mixed model of answers
};

/// Figures from a participant's function, for any task. PSE: of two intervals with levels on both
/// sides of the standard. JND there: half the distance of the levels of 25 and 75 %; of a forced
/// choice the threshold's distance from the standard. Weber fraction: JND / standard.
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
  /// Answers are reversed relative to the task, or to the other participants, by more than chance:
  /// twice the log likelihood of the better direction exceeds that of the expected one by the 0.95
  /// quantile of chi squared with one degree of freedom. The fit uses the direction of the answers.
  bool reversed = false;
  /// The threshold lies among the levels shown, its interval is closed, and the function is not
  /// reversed. Otherwise it is reported, but neither compared nor averaged.
  bool determined = false;
  LevelFigures figures;
  PsychometricPosterior posterior;  ///< of the same counts and model
  std::vector<Track> tracks;        ///< of more than one trial
  DetectionCounts catches;          ///< likewise; without catch trials, no noise trials
  Detectability detectability;      ///< detect and same/different with catch trials; else undefined
};

/// All trials of one task with a stimulus and a renderer in a block.
struct TaskCell {
  std::string task, block_name, shape, renderer;
  std::size_t trials = 0, answered = 0;
  std::size_t judged = 0, correct = 0;  ///< trials that can be right or wrong; right ones
  std::optional<double> standard_level;
  /// compare: all levels lie on one side of the standard, so the guess rate is 1 / `intervals`.
  bool forced_choice = false;
  bool same_different = false;  ///< compare: the answers are same or different
  int intervals = 2;            ///< compare
  protocols::LevelScale scale = protocols::LevelScale::linear;  ///< of its functions
  /// The levels with more successes, according to the task; none: unknown, so the direction of most
  /// participants is taken as correct.
  std::optional<protocols::Easier> expected_easier;
  std::string level_unit;   ///< "N/m", ...; "": unknown, or without unit
  std::string no_function;  ///< reason if no psychometric function is fitted; empty: it is
  std::vector<std::string> participants;           ///< indexed by `magnitude` and `adjustments`
  std::vector<ParticipantFunction> functions;      ///< compare, detect
  std::optional<MagnitudeEstimation> magnitude;    ///< rate: free numbers for levels
  std::optional<Ratings> ratings;                  ///< rate: labelled steps, or without levels
  std::vector<Adjustment> adjustments;             ///< adjust
  std::vector<Reaches> reaches;                    ///< reach
  std::optional<FieldAnalysis> field;              ///< levels of several dimensions
  std::optional<InformationTransfer> information;  ///< identify: over all its stimuli, pooled
  std::vector<InformationTransfer> informations;   ///< of each participant
  double information_most = 0;  ///< log2 of the number of stimuli or of answers, the lesser, bit
  TransformedMean information_mean;  ///< of the participants' corrected bits
  Type2Roc confidence;               ///< of all answers; undefined: nobody was asked
  TransformedMean confidence_mean;   ///< of the participants' areas
};

struct StudyAnalysis {
  StudyTable table;  ///< without times, which the analysis of identification holds
  FunctionSettings functions;
  std::string program_version;
  std::vector<TaskCell> cells;
  std::vector<TaskGroup> groups;
  std::vector<TaskComparison> renderers, conditions;
  TaskGroupResults group_models;
  std::vector<GroupedMeasure> by_design;   ///< empty: the study has neither groups nor factors
  std::vector<AnswerModel> answer_models;  ///< if they are wanted
  /// Times and accuracy of identification, over all its blocks; none: no identification.
  std::optional<Analysis> identification;
};

/// \param settings  of the analysis of identification
StudyAnalysis analyze_study(StudyTable table, const FunctionSettings& functions,
                            const AnalysisSettings& settings = {},
                            const std::string& program_version = {});

}  // namespace palpate::analysis
