#pragma once
// The procedures that choose the level of each trial: plain values from the protocol.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "data/base/random.h"
#include "protocols/procedures/field_function.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::protocols {

/// The seed of a track among several mixed ones.
/// \param seed  of InterleavedTracks
inline std::uint64_t track_seed(std::uint64_t seed, std::size_t track) {
  return Random(seed, {0x17, track}).next();
}

/// Method of constant stimuli: every level equally often. Each round of all levels has its own
/// order.
struct ConstantStimuli {
  std::vector<double> levels;
  int repetitions = 1;
  std::vector<LevelPoint> points = {};  ///< of several dimensions, in place of `levels`
};

/// Up-down staircase: `down` successes in a row make it harder by a step, `up` failures in a row
/// make it easier by step_ratio steps (Levitt 1971; weighted: Kaernbach 1991).
struct Staircase {
  double start = 0;
  /// On the scale; the i-th holds from the i-th reversal (from 0) on, the last for all later ones.
  std::vector<double> steps;
  int up = 1, down = 1;
  double step_ratio = 1;  ///< step to easier / step to harder
  LevelScale scale = LevelScale::linear;
  Easier easier = Easier::higher;
  double min = 0, max = 0;  ///< the levels stay within
  std::optional<int> stop_reversals;
  int stop_trials = 200;      ///< ends even without the reversals
  int discard_reversals = 2;  ///< the first ones, which the estimate leaves out
};

/// Probability of a success at which a staircase has no drift.
double convergence_point(const Staircase& spec);
/// The step ratio with which a staircase of `down` and up = 1 converges at `target`:
/// target^down / (1 - target^down).
double step_ratio_for(double target, int down);

/// Values of a parameter and their prior probabilities.
struct ParameterGrid {
  std::vector<double> values;
  std::vector<double> weights;  ///< > 0; empty: equally likely

  bool operator==(const ParameterGrid&) const = default;
};

/// QUEST+ (Watson 2017): chooses the level with the smallest expected entropy of the parameters.
struct QuestPlus {
  PsychometricFunction function;
  std::vector<double> levels;
  ParameterGrid threshold, slope, guess, lapse;
  int stop_trials = 60;
  std::optional<double> stop_entropy_bits;  ///< of the posterior of all parameters
};

/// Method of limits: ascending and descending series in turn, each until the answer changes.
struct Limits {
  double low = 0, high = 1;
  double step = 1;  ///< on the scale
  LevelScale scale = LevelScale::linear;
  Easier easier = Easier::higher;
  int series = 8;
  bool ascending_first = true;
  int jitter_steps = 0;  ///< a series starts up to so many steps inside, at random
};

/// A program chooses every level, within the range. Where it does not answer, levels come from a
/// sequence that covers the scale evenly.
struct Asked {
  double min = 0, max = 1;
  LevelScale scale = LevelScale::linear;
  Easier easier = Easier::higher;
  int stop_trials = 60;
};

/// The range of a dimension.
struct DimensionRange {
  double min = 0, max = 1;
  LevelScale scale = LevelScale::linear;  ///< on which points lie evenly
};

/// Points of Sobol's sequence, shifted by the seed: they fill the ranges evenly, however many there
/// are.
struct SobolPoints {
  std::vector<DimensionRange> ranges;  ///< of the dimensions, in their order
  int trials = 60;
};

/// A program chooses every point, within the ranges. Where it does not answer, points are `own`.
struct AskedPoints {
  SobolPoints own;
};

/// QUEST+ over points of several dimensions: chooses the point with the smallest expected entropy
/// of the parameters of interest.
struct FieldQuestPlus {
  FieldFunction function;
  std::vector<std::vector<double>> levels;  ///< of each dimension; points are their product
  /// Of the form's parameters in their order, then guess (unless the form has two lapses) and
  /// lapse.
  std::vector<ParameterGrid> parameters;
  std::vector<bool> interest;  ///< of each of these
  int stop_trials = 60;
  std::optional<double> stop_entropy_bits;  ///< of the posterior of all parameters

  bool operator==(const FieldQuestPlus&) const = default;
};

/// Names of `parameters`: "w", "c", "lapse".
std::vector<std::string> grid_names(FieldForm form);
/// All combinations of values, the last dimension varying fastest.
std::vector<LevelPoint> product_of(const std::vector<std::vector<double>>& levels);

using ProcedureSpec = std::variant<ConstantStimuli, Staircase, QuestPlus, Limits, Asked,
                                   SobolPoints, AskedPoints, FieldQuestPlus>;

/// "constant", "staircase", ...: as a protocol names it.
const char* kind_of(const ProcedureSpec& spec);
/// Of its levels; nullopt: constant stimuli, which have none.
std::optional<LevelScale> scale_of(const ProcedureSpec& spec);
/// The levels that are easier; nullopt: constant stimuli do not say.
std::optional<Easier> easier_of(const ProcedureSpec& spec);

/// Whether a program chooses every level.
bool is_asked(const ProcedureSpec& spec);

/// Levels that a procedure may request: all of them, or (Staircase) its start and the ends of its
/// range. Refuse a stimulus that a device cannot show at one of these before the first trial.
std::vector<double> levels_to_check(const ProcedureSpec& spec);
/// The same of points: all of them, or (ranges, and grids of more than kMostCheckedPoints) the
/// corners of their range. Empty: levels have one dimension.
std::vector<LevelPoint> points_to_check(const ProcedureSpec& spec);
inline constexpr std::size_t kMostCheckedPoints = 1000;
/// The least and most value of each dimension; empty: levels have one.
std::vector<DimensionRange> ranges_of(const ProcedureSpec& spec);
/// Upper limit on the trials of a procedure.
std::size_t most_trials(const ProcedureSpec& spec);

}  // namespace palpate::protocols
