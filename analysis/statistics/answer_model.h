#pragma once
// One mixed model of all answers of a block to levels: probit(answer) ~ level * group * renderer *
// factors + (1 + level | participant), with PSE and JND of each cell (Moscatelli, Mezzetti &
// Lacquaniti 2012). Lapses are not modelled.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/study_design.h"

namespace palpate::analysis {

/// A value with its intervals.
struct AnswerFigure {
  std::optional<double> estimate, se;  ///< by the delta method
  std::optional<Interval> ci95;        ///< normal; of a JND on the logarithm
  std::optional<Interval> bootstrap_ci95;
};

/// A cell of the design.
struct AnswerCell {
  std::size_t group = 0;
  std::vector<std::size_t> levels;  ///< of each factor of `within`
  std::size_t n_trials = 0, n_participants = 0;
  double intercept = 0, intercept_se = 0;  ///< at the model's centre
  double slope = 0, slope_se = 0;          ///< on the scale of the levels
  std::string undefined;  ///< reason if PSE and JND are missing; empty: they are not
  AnswerFigure pse;       ///< level of 50 %; of detection the threshold
  /// Half the distance of the levels of 25 and 75 %. On a logarithmic scale the ratio of half that
  /// distance minus 1, the Weber fraction.
  AnswerFigure jnd;
};

/// A contrast of PSEs or of JNDs; z in place of t, without degrees of freedom.
struct AnswerContrast {
  GroupContrast contrast;
  std::optional<Interval> bootstrap_ci95;
};

/// Wald's chi-squared test of an effect of type III.
struct AnswerEffect {
  std::string name;
  std::optional<double> chi_squared, df, p;
  std::optional<double> p_holm;  ///< over the effects of the measure that the protocol names
};

struct AnswerMeasure {
  /// Names and design alone, without figures. `logarithms`: contrasts are ratios.
  GroupedMeasure of;
  std::vector<AnswerEffect> effects;
  std::vector<AnswerContrast> contrasts;
};

struct AnswerModel {
  std::string undefined;  ///< reason if there is no model; empty: fitted
  std::string task, block_name, shape;
  bool log_levels = false;  ///< levels are log10 of them
  std::size_t n_answers = 0, n_participants = 0;
  std::vector<std::string> left_out;       ///< participants whose answers are reversed
  std::vector<std::string> without_group;  ///< participants whom the groups leave out
  double centre = 0;  ///< mean of the answers' levels, on their scale: intercepts are there
  double intercept_sd = 0, slope_sd = 0;  ///< between participants
  std::optional<double> correlation;      ///< of intercepts and slopes; none: one does not vary
  bool singular = false;
  double log_likelihood = 0;
  std::vector<AnswerCell> cells;
  AnswerMeasure pse, jnd;
  std::size_t bootstrapped = 0,
              failed = 0;  ///< simulated studies; those without a value of some cell
};

struct AnswerModelSettings {
  std::size_t bootstrap = 400;  ///< simulated studies; 0: none
  std::uint64_t seed = 2026;
  std::size_t jobs = 1;
};

/// A model of each block and stimulus of comparisons and detections. Forced choices of one side and
/// same/different have a reason instead: their chance of success is not from 0 to 1.
std::vector<AnswerModel> answer_models(const StudyAnalysis& analysis,
                                       const AnswerModelSettings& settings);

}  // namespace palpate::analysis
