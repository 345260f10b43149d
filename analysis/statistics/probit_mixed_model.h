#pragma once
// Generalised linear mixed model of yes/no answers to levels, probit(answer) ~ cell + cell:level +
// (1 + level | participant), by Laplace's approximation, like R's lme4::glmer (Bates et al. 2015).

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

namespace palpate {
class Random;
}

namespace palpate::analysis {

/// Answers of a participant to a level in a cell of the design.
struct LevelAnswers {
  std::size_t participant = 0, cell = 0;
  double place = 0;  ///< of the level on its scale
  double trials = 0, successes = 0;
};

/// Participants' intercepts and slopes are normal about those of each cell.
struct ProbitMixedModel {
  std::string undefined;  ///< reason if there is no fit; empty: fitted
  /// Of each cell its intercept (at place 0) and its slope, the latter in 1 / place.
  Eigen::VectorXd coefficients{};
  /// Of these, from the Hessian of the log likelihood by all parameters.
  Eigen::MatrixXd covariance{};
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();  ///< covariance of intercepts and slopes
  bool singular = false;                             ///< some direction of `spread` does not vary
  double log_likelihood = 0;                         ///< without binomial coefficients
};

/// \param cells  number of cells; each needs answers to two levels
ProbitMixedModel fit_probit_mixed(const std::vector<LevelAnswers>& answers, std::size_t cells);

/// The same without covariance, from a place near the maximum, for simulations.
ProbitMixedModel refit_probit_mixed(const std::vector<LevelAnswers>& answers, std::size_t cells,
                                    const ProbitMixedModel& near);

/// Other answers to the same levels, of other participants of the model.
std::vector<LevelAnswers> simulate_answers(const std::vector<LevelAnswers>& answers,
                                           const ProbitMixedModel& model, Random& random);

}  // namespace palpate::analysis
