#pragma once
// Mixed logistic regression by maximum likelihood with Laplace's approximation, like R's
// lme4::glmer(..., family = binomial) with its default nAGQ = 1 (Bates et al. 2015).

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Trials of a participant with the same predictors.
struct BinomialCell {
  std::size_t participant = 0;
  double trials = 0, successes = 0;
  std::vector<double> fixed;   ///< a row of the fixed effects' design
  std::vector<double> random;  ///< a row of the participant's effects' design; one or two
};

struct LogisticCoefficient {
  std::string name;
  double estimate = 0, se = 0;  ///< log odds
  double z = 0, p = 0;          ///< Wald, two-sided
  Interval ci95;
};

struct MixedLogistic {
  std::string undefined;
  bool singular = false;  ///< a participants' standard deviation is 0, or their correlation +-1
  std::size_t participants = 0, trials = 0;
  double log_likelihood = 0;  ///< of single trials in their order, as in glmer
  std::vector<LogisticCoefficient> coefficients;
  std::vector<double> random_sds;
  std::optional<double> random_correlation;
};

/// \param names  of the fixed effects
MixedLogistic mixed_logistic(const std::vector<BinomialCell>& cells,
                             const std::vector<std::string>& names);

/// correct ~ renderer + shape + (1 | participant), with the first renderer and shape as reference;
/// a time-out is wrong.
MixedLogistic accuracy_model(const TrialTable& table);

}  // namespace palpate::analysis
