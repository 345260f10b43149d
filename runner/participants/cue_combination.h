#pragma once
// How a simulated participant judges what it feels and sees at once: rules of the literature, not
// fitted to a person.

#include <optional>

namespace palpate::runner::participants {

struct CueSettings {
  enum class Rule {
    optimal,    ///< weighted by the inverse variances (Ernst & Banks 2002)
    best,       ///< the estimate of less noise alone
    switching,  ///< one of both, from trial to trial, vision with its optimal weight as probability
    causal,     ///< combined as far as both seem to have one cause (Koerding et al. 2007)
  };
  Rule rule = Rule::optimal;
  double weber_v = 0.05;  ///< sd of a seen estimate, as a share of the level
  double p_common = 1;    ///< causal: prior probability of one cause
};

/// Estimates of one interval, with their standard deviations; in the unit of the level.
struct CueEstimates {
  std::optional<double> felt, seen;  ///< not both empty
  double felt_sd = 0, seen_sd = 0;
  double range = 0;    ///< of the levels: two causes may be anywhere in it
  double lag = 0;      ///< s, of the seen behind the felt
  bool looks = false;  ///< switching: this trial is judged by what is seen
};

/// s; asynchrony of one sd lowers p_common to 61 %.
inline constexpr double kAsynchrony_s = 0.1;

/// The weight of the seen estimate that gives the least variance.
double weight_of_seen(double felt_sd, double seen_sd);

/// \throws nothing; one estimate alone is returned as it is
double combined_estimate(const CueSettings& settings, const CueEstimates& estimates);

}  // namespace palpate::runner::participants
