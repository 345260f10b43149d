#include "runner/participants/cue_combination.h"

#include <cmath>
#include <numbers>

namespace palpate::runner::participants {
namespace {

/// The probability that both estimates have one cause.
double probability_of_one_cause(const CueSettings& settings, const CueEstimates& estimates) {
  const double variance =
      estimates.felt_sd * estimates.felt_sd + estimates.seen_sd * estimates.seen_sd;
  const double apart = *estimates.felt - *estimates.seen;
  const double one =
      std::exp(-0.5 * apart * apart / variance) / std::sqrt(2 * std::numbers::pi * variance);
  const double two = estimates.range > 0 ? 1 / estimates.range : 0;
  const double late = estimates.lag / kAsynchrony_s;
  const double prior = settings.p_common * std::exp(-0.5 * late * late);
  const double sum = prior * one + (1 - prior) * two;
  return sum > 0 ? prior * one / sum : 0;
}

}  // namespace

double weight_of_seen(double felt_sd, double seen_sd) {
  const double felt = felt_sd * felt_sd, seen = seen_sd * seen_sd;
  return felt + seen > 0 ? felt / (felt + seen) : 0.5;
}

double combined_estimate(const CueSettings& settings, const CueEstimates& estimates) {
  if (!estimates.seen) return estimates.felt.value_or(0);
  if (!estimates.felt) return *estimates.seen;
  const double weight = weight_of_seen(estimates.felt_sd, estimates.seen_sd);
  const double both = weight * *estimates.seen + (1 - weight) * *estimates.felt;
  switch (settings.rule) {
    case CueSettings::Rule::optimal:
      return both;
    case CueSettings::Rule::best:
      return estimates.seen_sd < estimates.felt_sd ? *estimates.seen : *estimates.felt;
    case CueSettings::Rule::switching:
      return estimates.looks ? *estimates.seen : *estimates.felt;
    case CueSettings::Rule::causal: {
      const double one = probability_of_one_cause(settings, estimates);
      return one * both + (1 - one) * *estimates.felt;
    }
  }
  return both;
}

}  // namespace palpate::runner::participants
