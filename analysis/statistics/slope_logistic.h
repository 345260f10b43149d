#pragma once
// Logistic model of answers with two renderers: participants differ in level and in the effect of
// the renderer, like R's lme4::glmer(correct ~ r + shape + (1 + r || participant), binomial).

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace palpate::analysis {

/// Trials of a participant with a shape and a renderer.
struct RenderedAnswers {
  std::size_t participant = 0, shape = 0;  ///< both counted from 0 without gaps
  bool compared = false;                   ///< with the compared renderer, not the reference
  double trials = 0, correct = 0;
};

struct SlopeLogisticFit {
  double log_odds_ratio = 0;    ///< beyond kMostLogOdds: not told from infinite
  std::array<double, 2> sds{};  ///< of the participants' levels and effects; may be 0
  std::vector<double> shapes;   ///< log odds, at the middle of both renderers
  double log_likelihood = 0;    ///< Laplace's approximation, without binomial coefficients
};
inline constexpr double kMostLogOdds = 12;

/// logit = log_odds_ratio r + shape + u + s r, r = -1/2 (reference), +1/2; u and s independent and
/// normal over participants.
class SlopeLogistic {
 public:
  explicit SlopeLogistic(const std::vector<RenderedAnswers>& answers);

  const SlopeLogisticFit& best() const { return best_; }
  /// Twice the loss of log likelihood with the log odds ratio held.
  double likelihood_ratio(double log_odds_ratio) const;

 private:
  std::vector<std::vector<RenderedAnswers>> participants_;
  std::size_t shapes_ = 0;
  std::vector<double> place_;  ///< of the best fit
  SlopeLogisticFit best_;
};

}  // namespace palpate::analysis
