#pragma once
// Combination of what is felt and what is seen: weights, thresholds and rival models of each
// participant (Ernst & Banks 2002; Rohde, van Dam & Ernst 2016; Scarfe 2022).
//
// A comparison at level x is called the larger with probability
//   p(x) = lapse + (1 - 2 lapse) Phi((x - mu) / (sqrt(2) s)),
// s: standard deviation of a single estimate, in the unit of the level. A standard is seen at
// S + D/2 and felt at S - D/2, the comparison is congruent.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"
#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {

/// Answers of a block with both cues. Success: the comparison was called the larger.
struct CueBlock {
  std::string name;
  double conflict = 0, middle = 0;  ///< D and S
  std::vector<LevelCount> counts;
};

struct CueAnswers {
  std::string participant;
  std::vector<LevelCount> haptic, visual;
  std::vector<CueBlock> both;
};

/// How both cues may be combined.
enum class CueModel {
  optimal,        ///< weights by the inverse variances
  best_cue,       ///< the cue of the smaller standard deviation alone
  equal_weights,  ///< one half each
  free_weight,    ///< any weight, the variance of the optimal combination
  free,           ///< any weight and variance
  switching,      ///< from trial to trial one of the cues alone
  /// Combined as far as both seem to have one cause, else what is felt (Koerding et al. 2007; model
  /// averaging); two causes may be anywhere in the range of the levels. Needs kCausalConflicts.
  causal,
};
inline constexpr std::size_t kCueModels = 7;
inline constexpr std::size_t kCausalConflicts = 5;  ///< different ones, for the last model
/// "optimal", "best-cue", "equal-weights", "free-weight", "free", "switching", "causal"
const char* to_string(CueModel model);

/// A fit of all answers of a participant: lapse rate, both single cues with points of equality of
/// their own, and the blocks with both by the model.
struct CueModelFit {
  double log_likelihood = 0;
  int parameters = 0;
  double haptic_sd = 0, visual_sd = 0, lapse = 0;
  double weight = 0;   ///< of the seen; switching: its probability; causal: that of one cause
  double both_sd = 0;  ///< of a single combined estimate; switching, causal: none, 0
  double aic() const { return 2 * parameters - 2 * log_likelihood; }
};
CueModelFit fit_cues(const CueAnswers& answers, CueModel model);

/// A block of both cues with a point of equality of its own, all with one standard deviation; the
/// standard error is by the expected information of the answers.
struct CuePse {
  double conflict = 0, middle = 0, pse = 0, se = 0;
};

/// JNDs: 0.6745 times the standard deviation of the function, half the distance of the levels of 25
/// and 75 %.
struct CueParticipant {
  std::string participant;
  std::string undefined;        ///< reason if there are no figures
  double weight_visual = 0;     ///< 1/2 + slope of the points of equality over the conflict
  double weight_predicted = 0;  ///< s_h^2 / (s_v^2 + s_h^2)
  double jnd_haptic = 0, jnd_visual = 0, jnd_both = 0, jnd_predicted = 0;
  /// The smaller of the two JNDs, less the bias that a parametric bootstrap finds in taking the
  /// smaller of two estimates: about half of it, since it begins at estimates that differ by
  /// chance.
  double jnd_better = 0;
  std::vector<CuePse> points;
  std::vector<CueModelFit>
      models;  ///< in the order of CueModel; without the last where it needs more
  CueModel best = CueModel::optimal;  ///< of the least AIC
};

struct CueSettings {
  int resamples = 200;  ///< of the parametric bootstrap of jnd_better; 0: the plain minimum
  bool models = true;   ///< false: without the rival models
  std::uint64_t seed = 2026;
};

/// \param stream  of random numbers, such as the participant's place
CueParticipant analyze_cues(const CueAnswers& answers, const CueSettings& settings,
                            std::uint64_t stream);

struct CueModelSum {
  CueModel model = CueModel::optimal;
  double aic = 0;            ///< summed over participants
  std::size_t best_for = 0;  ///< participants with the least AIC
};

/// A paired comparison over participants.
struct CueTest {
  double mean = 0;
  TTest test;
};

struct CueAnalysis {
  std::vector<CueParticipant> participants;
  std::vector<std::pair<std::string, std::string>> left_out;  ///< participant and reason
  CueTest weight;                                             ///< observed less predicted
  CueTest jnd_predicted;  ///< log of the JND of both by the predicted one
  CueTest jnd_better;     ///< log of the JND of both by that of the better cue
  std::vector<CueModelSum> models;
  std::string level_name, unit;  ///< "size", "m"; "1": without
  bool simulated = false;
  CueSettings settings;
};

/// Analyses of all participants and tests over them. Answers without trials in a block are left
/// out.
CueAnalysis analyze_all_cues(const std::vector<CueAnswers>& answers, const CueSettings& settings);

/// Of two cues with these standard deviations: the optimal weight of the second, and the standard
/// deviation of both.
struct CueOptimum {
  double weight = 0, sd = 0;
};
CueOptimum optimum_of(double haptic_sd, double visual_sd);

}  // namespace palpate::analysis
