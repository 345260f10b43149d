#pragma once
// The choice of the next level: a pure function of the spec, the seed and the answers so far, the
// same on every machine and compiler.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

/// One answered trial.
struct Response {
  double level = 0;       ///< as it was shown
  bool success = false;   ///< correct (forced choice), or "yes"
  LevelPoint point = {};  ///< of several dimensions, in place of `level`
};

/// The estimates from the answers so far; nullopt if a procedure does not estimate the value.
struct Estimate {
  std::optional<double> threshold;           ///< a level
  std::optional<double> threshold_scale_sd;  ///< on the procedure's scale
  std::optional<double> slope, guess, lapse;
  int trials = 0;
  int reversals = 0;
  /// Trials at an end of the range (Staircase), series without a change (Limits): many of them mean
  /// that the threshold lies outside the range.
  int at_limit = 0;
  /// FieldQuestPlus: means of the posterior, as grid_names.
  std::vector<double> parameters = {};
};

class ConstantStimuliRun {
 public:
  ConstantStimuliRun(const ConstantStimuli& spec, std::uint64_t seed);

  std::optional<double> next_level() const;
  std::optional<LevelPoint> next_point() const;
  void record(const Response& response);
  Estimate estimate() const;  ///< counts only: the analysis estimates the threshold

 private:
  std::vector<double> order_;
  std::vector<LevelPoint> points_;
  std::size_t trials_ = 0;
};

/// Levels of a series until its end, from `inside` steps within the range.
std::vector<double> series_levels(const Limits& spec, bool ascending, int inside);

class LimitsRun {
 public:
  LimitsRun(const Limits& spec, std::uint64_t seed);

  std::optional<double> next_level() const;
  void record(const Response& response);
  /// Threshold: mean on the scale over the series with a change, each taken half a step before the
  /// change.
  Estimate estimate() const;

 private:
  struct Series {
    bool ascending = true;
    std::vector<double> levels;
  };

  Limits spec_;
  std::vector<Series> series_;
  std::size_t current_ = 0, place_ = 0;  // series, level within it
  std::vector<double> changes_;          // on the scale
  int trials_ = 0, unchanged_ = 0;
};

/// Continues from the level shown, even where it differs from the one requested.
class StaircaseRun {
 public:
  explicit StaircaseRun(Staircase spec);

  std::optional<double> next_level() const;
  void record(const Response& response);
  /// Threshold: mean on the scale of an even number of reversals after the discarded ones; of an
  /// odd number the first is left out, too, so that peaks and valleys balance (Levitt 1971).
  Estimate estimate() const;
  /// Levels at which the direction reversed.
  std::vector<double> reversal_levels() const;

 private:
  void move(bool harder);

  Staircase spec_;
  double position_, low_, high_;  // on the scale
  int successes_ = 0, failures_ = 0;
  int direction_ = 0;  // of the last move: 1 harder, -1 easier
  std::vector<double> reversals_;
  int trials_ = 0, at_limit_ = 0;
};

/// The levels of its own are points of van der Corput's sequence on the scale, from a random start.
class AskedRun {
 public:
  AskedRun(const Asked& spec, std::uint64_t seed);

  std::optional<double> next_level() const;
  void record(const Response& response);
  Estimate estimate() const;  ///< counts only: the analysis estimates the threshold

 private:
  Asked spec_;
  double start_;  ///< share of the range
  int trials_ = 0;
};

/// Levels of QUEST+ whose expected information differs by less are equally good.
inline constexpr double kTieBits = 1e-10;

struct QuestPlusTables;

/// Watson 2017, "QUEST+: A general multidimensional Bayesian adaptive psychometric method".
/// Departs: the expected entropy is the prior entropy less the mutual information of answer and
/// parameters, which needs no logarithm of the posterior. Ties within 1e-10 bit go to the first
/// level.
class QuestPlusRun {
 public:
  explicit QuestPlusRun(const QuestPlus& spec);

  std::optional<double> next_level() const;
  /// A level off the grid counts at its true value.
  void record(const Response& response);
  /// Means of the posterior, the threshold's on the scale.
  Estimate estimate() const;

  /// Expected information of an answer at each level, bit.
  std::vector<double> expected_information() const;
  double entropy_bits() const;  ///< of the posterior
  /// Posterior of all parameters, the lapse varying fastest, then guess, slope, threshold.
  const std::vector<double>& posterior() const { return posterior_; }
  /// Posterior of one parameter: 0 threshold, 1 slope, 2 guess, 3 lapse.
  std::vector<double> marginal(std::size_t parameter) const;

 private:
  std::shared_ptr<const QuestPlusTables> tables_;
  std::vector<double> posterior_;
  int trials_ = 0;
};

/// Levels do not follow from the answers.
class SobolRun {
 public:
  SobolRun(SobolPoints spec, std::uint64_t seed) : spec_(std::move(spec)), seed_(seed) {}

  std::optional<LevelPoint> next_point() const;
  void record(const Response& response);
  Estimate estimate() const;  ///< counts only

 private:
  SobolPoints spec_;
  std::uint64_t seed_;
  int trials_ = 0;
};

struct FieldQuestPlusTables;

/// Watson 2017, as QuestPlusRun, over points of several dimensions. Parameters that are not of
/// interest are summed over: the expected entropy is that of the others' marginal posterior. Ties
/// within 1e-10 bit go to the first point. Probabilities are tabulated once, in single precision,
/// for all copies of a run.
class FieldQuestPlusRun {
 public:
  explicit FieldQuestPlusRun(const FieldQuestPlus& spec);

  std::optional<LevelPoint> next_point() const;
  /// A point off the grid counts at its true place.
  void record(const Response& response);
  /// Means of the posterior.
  Estimate estimate() const;

  /// Expected information of an answer about the parameters of interest at each point, bit.
  std::vector<double> expected_information() const;
  double entropy_bits() const;  ///< of the posterior of all parameters
  /// Posterior of all parameters, the last varying fastest.
  const std::vector<double>& posterior() const { return posterior_; }
  /// Posterior of one parameter, by its place in grid_names.
  std::vector<double> marginal(std::size_t parameter) const;

 private:
  void find_next();

  std::shared_ptr<const FieldQuestPlusTables> tables_;
  std::vector<double> posterior_;
  std::optional<std::size_t> next_;  ///< index of the point
  int trials_ = 0;
};

/// A procedure and the answers to it. Copies are independent. A resumed session records its answers
/// again, one by one.
class Procedure {
 public:
  /// \param spec  as checked by the parser
  Procedure(const ProcedureSpec& spec, std::uint64_t seed);

  /// nullopt: the procedure has ended, or its levels have several dimensions
  std::optional<double> next_level() const;
  /// nullopt: the procedure has ended, or its levels have one dimension
  std::optional<LevelPoint> next_point() const;
  bool ended() const { return !next_level() && !next_point(); }
  /// Do not record an unanswered trial: its level is repeated.
  void record(const Response& response);
  Estimate estimate() const;
  const std::vector<Response>& history() const { return history_; }

 private:
  std::variant<ConstantStimuliRun, StaircaseRun, QuestPlusRun, LimitsRun, AskedRun, SobolRun,
               FieldQuestPlusRun>
      run_;
  std::vector<Response> history_;
};

/// A level and the track that requests it.
struct TrackLevel {
  std::size_t track = 0;
  double level = 0;
  LevelPoint point = {};  ///< of several dimensions, in place of `level`
};

/// The order of a round's tracks: every unfinished one, shuffled.
/// \param seed  of InterleavedTracks \param round  from 0
std::vector<std::size_t> round_of_tracks(std::uint64_t seed, std::uint64_t round,
                                         std::vector<std::size_t> unfinished);

/// Several procedures whose trials are mixed: each round has one trial of every unfinished track,
/// in random order.
class InterleavedTracks {
 public:
  InterleavedTracks(const std::vector<ProcedureSpec>& specs, std::uint64_t seed);

  std::optional<TrackLevel> next() const;  ///< nullopt: all have ended
  /// Records the answer to a trial of next().track.
  void record(const Response& response);
  const std::vector<Procedure>& tracks() const { return tracks_; }

 private:
  void begin_round();

  std::uint64_t seed_;
  std::vector<Procedure> tracks_;
  std::vector<std::size_t> round_;  // tracks to come, the next one last
  std::uint64_t rounds_ = 0;
};

}  // namespace palpate::protocols
