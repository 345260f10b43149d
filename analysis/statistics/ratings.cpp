#include "analysis/statistics/ratings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/quantiles.h"

namespace palpate::analysis {
namespace {

using NumbersByParticipant = std::map<std::size_t, std::vector<double>>;

RatingSpread spread_of(std::vector<double> numbers) {
  RatingSpread spread;
  spread.ratings = numbers.size();
  if (numbers.empty()) return spread;
  std::sort(numbers.begin(), numbers.end());
  spread.mean = mean(numbers);
  spread.lower_quartile = sorted_quantile(numbers, 0.25);
  spread.median = sorted_quantile(numbers, 0.5);
  spread.upper_quartile = sorted_quantile(numbers, 0.75);
  return spread;
}

RatingSpread spread_of(const NumbersByParticipant& numbers) {
  std::vector<double> all;
  for (const auto& [participant, own] : numbers) all.insert(all.end(), own.begin(), own.end());
  return spread_of(std::move(all));
}

std::vector<ParticipantRatings> spreads_of(const NumbersByParticipant& numbers) {
  std::vector<ParticipantRatings> spreads;
  for (const auto& [participant, own] : numbers) spreads.push_back({participant, spread_of(own)});
  return spreads;
}

MeanRating mean_of(const std::vector<ParticipantRatings>& participants) {
  MeanRating result;
  std::vector<double> means;
  for (const ParticipantRatings& one : participants) means.push_back(one.spread.mean);
  result.participants = means.size();
  if (means.empty()) return result;
  result.mean = mean(means);
  result.sd = standard_deviation(means);
  result.ci95 = t_test(means).log_ratio_ci95;
  return result;
}

/// Each whole number that occurs; none if there are too many, or fractions.
std::vector<RatingStep> steps_in(const NumbersByParticipant& numbers) {
  std::set<double> found;
  for (const auto& [participant, own] : numbers) found.insert(own.begin(), own.end());
  const bool whole =
      std::all_of(found.begin(), found.end(), [](double one) { return one == std::round(one); });
  std::vector<RatingStep> steps;
  if (!whole || found.size() > kMostRatingSteps) return steps;
  for (const double number : found) steps.push_back({number, "", 0, 0});
  return steps;
}

void count(std::vector<RatingStep>& steps, const NumbersByParticipant& numbers) {
  for (RatingStep& step : steps) {
    for (const auto& [participant, own] : numbers) {
      const auto n = std::count(own.begin(), own.end(), step.number);
      step.count += static_cast<std::size_t>(n);
      step.share += static_cast<double>(n) / static_cast<double>(own.size()) /
                    static_cast<double>(numbers.size());
    }
  }
}

}  // namespace

Ratings ratings_of(const std::vector<Rating>& ratings, std::vector<RatingStep> steps) {
  Ratings result;
  NumbersByParticipant numbers;
  std::map<double, NumbersByParticipant> by_level;
  for (const Rating& one : ratings) {
    numbers[one.participant].push_back(one.number);
    if (one.level) by_level[*one.level][one.participant].push_back(one.number);
  }
  result.steps = steps.empty() ? steps_in(numbers) : std::move(steps);
  result.labelled = std::any_of(result.steps.begin(), result.steps.end(),
                                [](const RatingStep& step) { return !step.label.empty(); });
  count(result.steps, numbers);
  result.spread = spread_of(numbers);
  result.participants = spreads_of(numbers);
  result.mean = mean_of(result.participants);
  for (const auto& [level, own] : by_level) {
    RatingsAtLevel& at = result.levels.emplace_back();
    at.level = level;
    at.spread = spread_of(own);
    at.participants = spreads_of(own);
    at.mean = mean_of(at.participants);
  }
  return result;
}

}  // namespace palpate::analysis
