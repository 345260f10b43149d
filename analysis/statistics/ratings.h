#pragma once
// Ratings on labelled steps, and numbers for stimuli that no level orders: shares of the steps,
// medians, quartiles, and participants' means. A step is further on the scale than another; how
// much further is unknown, so no power law is fitted.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// One rating of a participant.
struct Rating {
  std::size_t participant = 0;
  double number = 0;            ///< of the step, or as typed
  std::optional<double> level;  ///< of the stimulus, if it was varied
};

/// A step of the scale.
struct RatingStep {
  double number = 0;
  std::string label;      ///< "": only the number is known
  std::size_t count = 0;  ///< ratings
  double share = 0;       ///< mean over participants of the share of their ratings, 0 to 1
};

/// Median and quartiles (type 7 of Hyndman & Fan 1996, as R's default) and mean.
struct RatingSpread {
  std::size_t ratings = 0;
  double mean = 0, lower_quartile = 0, median = 0, upper_quartile = 0;
};

struct ParticipantRatings {
  std::size_t participant = 0;
  RatingSpread spread;
};

/// Mean over participants of their mean ratings, with its t interval; none below two.
struct MeanRating {
  std::size_t participants = 0;
  std::optional<double> mean, sd;
  std::optional<Interval> ci95;
};

struct RatingsAtLevel {
  double level = 0;
  RatingSpread spread;
  MeanRating mean;
  std::vector<ParticipantRatings> participants;  ///< in their order
};

struct Ratings {
  bool labelled = false;                         ///< steps have labels
  std::vector<RatingStep> steps;                 ///< in order; empty: numbers without few steps
  RatingSpread spread;                           ///< of all ratings together
  std::vector<ParticipantRatings> participants;  ///< in their order
  MeanRating mean;
  std::vector<RatingsAtLevel> levels;  ///< in order; empty: no level was varied
};

/// Numbers without steps get steps if all are whole numbers and at most so many differ.
constexpr std::size_t kMostRatingSteps = 11;

/// \param steps  of the scale, in order, with number and label; empty: unknown
Ratings ratings_of(const std::vector<Rating>& ratings, std::vector<RatingStep> steps);

/// Fewest pairs that differ with which an exact two-sided Wilcoxon test can have p < 0.05.
constexpr std::size_t kLeastForWilcoxon = 6;

}  // namespace palpate::analysis
