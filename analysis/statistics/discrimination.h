#pragma once
// Figures of fitted functions (PSE, JND, Weber fraction), sensitivity and criterion of yes/no,
// two-interval and same/different tasks, and confidence.

#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"
#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {

/// Figures derived from a fitted function. JND: half the distance between the levels of F = 0.25
/// and 0.75, on a linear scale in its unit. On a logarithmic scale, the ratio of half that distance
/// minus 1 is the Weber fraction.
struct Discrimination {
  double pse = 0;  ///< level of F = 0.5
  Interval pse_ci95;
  std::optional<double> jnd;
  std::optional<Interval> jnd_ci95;
  std::optional<double> weber_fraction;  ///< linear scale: JND / standard above 0
  std::optional<Interval> weber_fraction_ci95;
};

/// \param standard  level of the standard; nullopt: the PSE
Discrimination discrimination(const PsychometricFit& fit,
                              const protocols::PsychometricFunction& function,
                              std::optional<double> standard);

/// Counts of answers "yes" (or "different", or "the second") with and without a signal.
struct DetectionCounts {
  int signal_trials = 0, hits = 0;
  int noise_trials = 0, false_alarms = 0;
};

/// Model of the observer.
enum class DetectionTask {
  yes_no,
  two_interval,   ///< signal: in the second interval; noise: in the first
  same_different  ///< signal: they differ; decided by their difference (not by classes)
};

/// Rates are from counts with 0.5 added to hits and false alarms and 1 to trials, always
/// (log-linear correction, Hautus 1995). Intervals are normal, with the variance of Gourevitch &
/// Galanter 1967 (same/different: by the delta method).
struct Detectability {
  std::string undefined;
  double hit_rate = 0, false_alarm_rate = 0;  ///< corrected
  std::optional<double> d_prime, d_prime_se;
  std::optional<Interval> d_prime_ci95;
  /// yes/no: distance of the criterion from the unbiased one, in d' units; positive: biased to "no"
  /// (two_interval: to the first; in units of one interval's d'). same_different: the smallest
  /// difference called different.
  std::optional<double> criterion;
  std::optional<Interval> criterion_ci95;
};

Detectability detectability(const DetectionCounts& counts, DetectionTask task);

/// Share correct of m-alternative forced choice without bias: integral phi(x - d') Phi(x)^(m - 1)
/// dx (Hacker & Ratcliff 1979; Green & Dai 1991). A d' below 0 is worse than chance.
double forced_choice_share(double d_prime, int alternatives);
/// Its inverse. nullopt: a share of 0 or 1.
std::optional<double> forced_choice_d_prime(double share, int alternatives);

/// d' of a participant from the corrected share (k + 1/2) / (n + 1); its interval is Wilson's of
/// the share, mapped to d'. With few trials a large d' is too small: of 2 alternatives and 20
/// trials by 0.06 at 2, by 0.43 at 3.
struct ForcedChoiceDetectability {
  double share = 0;  ///< corrected
  double d_prime = 0;
  Interval d_prime_ci95;
};

/// \param trials  above 0
ForcedChoiceDetectability forced_choice_detectability(int correct, int trials, int alternatives);

/// Correctness of an answer, and the participant's confidence in it.
struct ConfidenceTrial {
  bool correct = false;
  double confidence = 0;  ///< any scale; larger: more confident
};

/// Area under the type 2 ROC: probability that a correct answer has more confidence than a wrong
/// one; ties count half. Interval by DeLong et al. 1988 on the logit scale.
struct Type2Roc {
  std::string undefined;
  int correct = 0, wrong = 0;
  std::optional<double> area, se;
  std::optional<Interval> area_ci95;
  /// Points (share of wrong, share of correct answers with at least a given confidence), from (0,
  /// 0) to (1, 1).
  struct Point {
    double wrong = 0, correct = 0;
  };
  std::vector<Point> curve;
};

Type2Roc type2_roc(const std::vector<ConfidenceTrial>& trials);

}  // namespace palpate::analysis
