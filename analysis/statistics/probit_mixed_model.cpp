#include "analysis/statistics/probit_mixed_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "analysis/statistics/bounded_search.h"
#include "analysis/statistics/normal_tail.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kMostPeopleSd = 20;     ///< of participants, in standard deviations of the noise
constexpr double kMostCoefficient = 40;  ///< at standardised places: a step
constexpr double kNoSpread = 1e-4;       ///< as lme4's isSingular()

// Parameters: of each cell its intercept and slope at standardised places; then the lower triangle
// L of the participants' standard deviations, by column. An effect is L (u, v), with u and v
// standard normal.

Index triangle_at(Index parameters) { return parameters - 3; }

Matrix2d spread_triangle(const VectorXd& x) {
  const Index t = triangle_at(x.size());
  return (Matrix2d() << x[t], 0, x[t + 1], x[t + 2]).finished();
}

/// Log likelihood of answers with its derivatives by the predictor, and the expected information
/// with its own.
struct ProbitAnswered {
  double value = 0, slope = 0, bend = 0, weight = 0, weight_slope = 0;
};

ProbitAnswered probit_answered(const LevelAnswers& one, double eta) {
  const NormalTail yes = upper_tail(-eta), no = upper_tail(eta);
  const double failures = one.trials - one.successes;
  ProbitAnswered out;
  out.value = one.successes * yes.log + failures * no.log;
  out.slope = one.successes * yes.hazard - failures * no.hazard;
  out.bend =
      -one.successes * yes.hazard * (yes.hazard + eta) - failures * no.hazard * (no.hazard - eta);
  out.weight = one.trials * yes.hazard * no.hazard;
  out.weight_slope = out.weight * (no.hazard - yes.hazard - 2 * eta);
  return out;
}

using PersonAnswers = std::vector<LevelAnswers>;

Vector2d design_row(const LevelAnswers& one) { return {1, one.place}; }

double fixed_part(const LevelAnswers& one, const VectorXd& x) {
  const auto at = 2 * static_cast<Index>(one.cell);
  return x[at] + x[at + 1] * one.place;
}

/// Log density of a participant's answers and effects, with its slope and minus its second
/// derivatives.
struct EffectsDensity {
  double value = 0;
  Vector2d slope = Vector2d::Zero();
  Matrix2d curvature = Matrix2d::Identity();
};

EffectsDensity density_at(const PersonAnswers& answers, const VectorXd& x,
                          const Vector2d& effects) {
  const Matrix2d loads = spread_triangle(x);
  EffectsDensity out;
  out.value = -0.5 * effects.squaredNorm();
  out.slope = -effects;
  for (const LevelAnswers& one : answers) {
    const Vector2d load = loads.transpose() * design_row(one);
    const ProbitAnswered at = probit_answered(one, fixed_part(one, x) + load.dot(effects));
    out.value += at.value;
    out.slope += at.slope * load;
    out.curvature -= at.bend * load * load.transpose();
  }
  return out;
}

/// Moves the effects to the most likely ones, by Newton's method with halved steps: the density is
/// log-concave. \param effects  where to begin
EffectsDensity find_effects(const PersonAnswers& answers, const VectorXd& x, Vector2d& effects) {
  EffectsDensity at = density_at(answers, x, effects);
  for (int i = 0; i < 100; ++i) {
    const Vector2d step = at.curvature.inverse() * at.slope;
    double length = 1;
    EffectsDensity next = density_at(answers, x, effects + step);
    const double least = at.value - 1e-12 * (1 + std::abs(at.value));
    while (!(next.value >= least) && length > 1e-8) {
      length *= 0.5;
      next = density_at(answers, x, effects + length * step);
    }
    // A step is as wrong as the square of its size: after one of 1e-7 nothing is left to gain.
    const bool near = step.norm() < 1e-7 * (1 + effects.norm());
    effects += length * step;
    at = next;
    if (near) break;
  }
  return at;
}

/// Laplace's approximation of a participant's log likelihood, with the expected information in the
/// determinant as lme4 has it. Adds its gradient, with the move of the mode in the determinant.
double laplace_of_participant(const PersonAnswers& answers, const VectorXd& x, Vector2d& effects,
                              VectorXd& gradient) {
  const EffectsDensity mode = find_effects(answers, x, effects);
  const Matrix2d loads = spread_triangle(x);
  std::vector<ProbitAnswered> at;
  at.reserve(answers.size());
  Matrix2d information = Matrix2d::Identity();
  for (const LevelAnswers& one : answers) {
    const Vector2d load = loads.transpose() * design_row(one);
    at.push_back(probit_answered(one, fixed_part(one, x) + load.dot(effects)));
    information += at.back().weight * load * load.transpose();
  }
  const Matrix2d inverse = information.inverse();
  Vector2d pull = Vector2d::Zero();  // change of the log determinant as the mode moves
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const Vector2d load = loads.transpose() * design_row(answers[k]);
    pull += at[k].weight_slope * load.dot(inverse * load) * load;
  }
  const Vector2d moved = mode.curvature.inverse() * pull;
  const Index t = triangle_at(x.size());
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const Vector2d load = loads.transpose() * design_row(answers[k]);
    const double place = answers[k].place;
    const double by_eta = at[k].slope - 0.5 * (at[k].weight_slope * load.dot(inverse * load) +
                                               at[k].bend * load.dot(moved));
    const Vector2d by_load = -0.5 * at[k].slope * moved - at[k].weight * (inverse * load);
    const auto cell = 2 * static_cast<Index>(answers[k].cell);
    gradient[cell] += by_eta;
    gradient[cell + 1] += by_eta * place;
    gradient[t] += by_eta * effects[0] + by_load[0];
    gradient[t + 1] += place * (by_eta * effects[0] + by_load[0]);
    gradient[t + 2] += place * (by_eta * effects[1] + by_load[1]);
  }
  return mode.value - 0.5 * std::log(information.determinant());
}

/// Mean and standard deviation of the places.
struct PlaceScale {
  double centre = 0, unit = 1;
};

PlaceScale place_scale(const PersonAnswers& answers) {
  double n = 0, sum = 0, squares = 0;
  for (const LevelAnswers& one : answers) {
    n += one.trials;
    sum += one.trials * one.place;
  }
  const double centre = sum / n;
  for (const LevelAnswers& one : answers)
    squares += one.trials * (one.place - centre) * (one.place - centre);
  return {centre, std::sqrt(squares / n)};
}

std::vector<PersonAnswers> standardised(const PersonAnswers& answers, const PlaceScale& scale) {
  std::vector<PersonAnswers> out;
  for (LevelAnswers one : answers) {
    one.place = (one.place - scale.centre) / scale.unit;
    out.resize(std::max(out.size(), one.participant + 1));
    out[one.participant].push_back(one);
  }
  return out;
}

Objective probit_loss(const std::vector<PersonAnswers>& participants) {
  // Each mode is near that of the last place.
  return [&participants, modes = std::vector<Vector2d>(participants.size(), Vector2d::Zero())](
             const VectorXd& x, VectorXd& gradient) mutable {
    gradient.setZero();
    double sum = 0;
    for (std::size_t i = 0; i < participants.size(); ++i)
      sum -= laplace_of_participant(participants[i], x, modes[i], gradient);
    gradient = -gradient;
    return sum;
  };
}

Bounds probit_bounds(Index size) {
  Bounds bounds{VectorXd::Constant(size, -kMostCoefficient),
                VectorXd::Constant(size, kMostCoefficient)};
  // The likelihood is even in the columns. A bound at 0 would stop a search where the slope is 0.
  bounds.low.tail(3).setConstant(-kMostPeopleSd);
  bounds.high.tail(3).setConstant(kMostPeopleSd);
  return bounds;
}

/// Intercepts and slopes as if all answers were of one participant, by Fisher's scoring.
VectorXd pooled_start(const std::vector<PersonAnswers>& participants, std::size_t cells) {
  const auto n = static_cast<Index>(cells);
  VectorXd x = VectorXd::Zero(2 * n + 3);
  for (int i = 0; i < 25; ++i) {
    std::vector<Matrix2d> information(cells, 1e-3 * Matrix2d::Identity());
    std::vector<Vector2d> slope(cells, Vector2d::Zero());
    for (const PersonAnswers& own : participants) {
      for (const LevelAnswers& one : own) {
        const ProbitAnswered at = probit_answered(one, fixed_part(one, x));
        information[one.cell] += at.weight * design_row(one) * design_row(one).transpose();
        slope[one.cell] += at.slope * design_row(one);
      }
    }
    for (Index c = 0; c < n; ++c) {
      const Vector2d step =
          information[static_cast<std::size_t>(c)].inverse() * slope[static_cast<std::size_t>(c)];
      x.segment<2>(2 * c) += step / std::max(1.0, step.norm());
    }
  }
  return x.cwiseMax(-kMostCoefficient / 2).cwiseMin(kMostCoefficient / 2);
}

/// Minus the second derivatives of the log likelihood, by differences of its gradient.
MatrixXd information_of(const Objective& loss, const VectorXd& x) {
  const Index n = x.size();
  MatrixXd out(n, n);
  VectorXd above(n), below(n);
  for (Index k = 0; k < n; ++k) {
    const double step = 1e-4 * std::max(1.0, std::abs(x[k]));
    VectorXd moved = x;
    moved[k] = x[k] + step;
    loss(moved, above);
    moved[k] = x[k] - step;
    loss(moved, below);
    out.col(k) = (above - below) / (2 * step);
  }
  return 0.5 * (out + out.transpose());
}

/// Changes intercepts and slopes at standardised places into those at places.
MatrixXd unstandardised(const PlaceScale& scale, Index cells) {
  MatrixXd out = MatrixXd::Zero(2 * cells, 2 * cells);
  for (Index c = 0; c < cells; ++c)
    out.block<2, 2>(2 * c, 2 * c) << 1, -scale.centre / scale.unit, 0, 1 / scale.unit;
  return out;
}

/// The places of a participant's successes and failures in a cell.
struct PlacesOfAnswers {
  std::set<double> successes, failures;

  /// No slope is too steep for them, but for the sign.
  bool step(bool rising) const {
    if (successes.empty() || failures.empty()) return true;
    return rising ? *failures.rbegin() <= *successes.begin()
                  : *successes.rbegin() <= *failures.begin();
  }
};

std::string why_no_probit_model(const PersonAnswers& answers, std::size_t cells) {
  std::vector<std::map<std::size_t, PlacesOfAnswers>> places(cells);
  std::set<std::size_t> participants;
  for (const LevelAnswers& one : answers) {
    PlacesOfAnswers& own = places[one.cell][one.participant];
    if (one.successes > 0) own.successes.insert(one.place);
    if (one.successes < one.trials) own.failures.insert(one.place);
    participants.insert(one.participant);
  }
  if (participants.size() < 2) return "one participant, so no variance between participants";
  for (const auto& people : places) {
    std::set<double> all;
    for (const auto& [participant, own] : people) {
      all.insert(own.successes.begin(), own.successes.end());
      all.insert(own.failures.begin(), own.failures.end());
    }
    if (all.size() < 2) return "a cell has answers to fewer than two levels";
    for (const bool rising : {true, false}) {
      if (std::ranges::all_of(people, [&](const auto& one) { return one.second.step(rising); }))
        return "everybody's answers in a cell change in one step, so no slope is too steep";
    }
  }
  return "";
}

ProbitMixedModel model_at(const Minimum& found, const PlaceScale& scale, Index cells) {
  ProbitMixedModel out;
  const VectorXd& x = found.place;
  out.log_likelihood = -found.value;
  if (x.head(2 * cells).cwiseAbs().maxCoeff() > kMostCoefficient * (1 - 1e-9) ||
      x.tail(3).cwiseAbs().maxCoeff() > kMostPeopleSd * (1 - 1e-9)) {
    out.undefined = "a slope or the spread of participants grows without end";
    return out;
  }
  const Matrix2d loads = spread_triangle(x);
  out.singular = std::min(std::abs(loads(0, 0)), std::abs(loads(1, 1))) < kNoSpread;
  out.coefficients = unstandardised(scale, cells) * x.head(2 * cells);
  const Matrix2d turn = unstandardised(scale, 1);
  out.spread = turn * loads * loads.transpose() * turn.transpose();
  return out;
}

/// Answers at standardised places, by participant; or the reason why they have no model.
struct PlacedAnswers {
  PlacedAnswers(const PersonAnswers& answers, std::size_t cells)
      : undefined(why_no_probit_model(answers, cells)) {
    if (!undefined.empty()) return;
    scale = place_scale(answers);
    participants = standardised(answers, scale);
  }

  std::string undefined;
  PlaceScale scale;
  std::vector<PersonAnswers> participants;
};

}  // namespace

ProbitMixedModel fit_probit_mixed(const std::vector<LevelAnswers>& answers, std::size_t cells) {
  const PlacedAnswers placed(answers, cells);
  if (!placed.undefined.empty()) return {placed.undefined};
  const PlaceScale& scale = placed.scale;
  const Objective loss = probit_loss(placed.participants);
  const VectorXd pooled = pooled_start(placed.participants, cells);
  std::vector<VectorXd> starts;
  for (const auto& [level, slope] : {std::pair{0.3, 0.3}, std::pair{1.0, 0.7}}) {
    VectorXd& start = starts.emplace_back(pooled);
    const double attenuated = std::sqrt(1 + level * level);
    start.head(start.size() - 3) *= attenuated;
    start.tail(3) << level, 0, slope;
  }
  const Minimum found = best_of(loss, starts, probit_bounds(pooled.size()));
  const auto n = static_cast<Index>(cells);
  ProbitMixedModel out = model_at(found, scale, n);
  if (!out.undefined.empty()) return out;
  const Eigen::LDLT<MatrixXd> information(information_of(loss, found.place));
  if (information.info() != Eigen::Success || !(information.vectorD().minCoeff() > 0)) {
    out.undefined = "the fit did not converge";
    return out;
  }
  const Index size = found.place.size();
  const MatrixXd covariance = information.solve(MatrixXd::Identity(size, size));
  const MatrixXd turn = unstandardised(scale, n);
  out.covariance = turn * covariance.topLeftCorner(2 * n, 2 * n) * turn.transpose();
  return out;
}

ProbitMixedModel refit_probit_mixed(const std::vector<LevelAnswers>& answers, std::size_t cells,
                                    const ProbitMixedModel& near) {
  const PlacedAnswers placed(answers, cells);
  if (!placed.undefined.empty()) return {placed.undefined};
  const PlaceScale& scale = placed.scale;
  const auto n = static_cast<Index>(cells);
  const MatrixXd turn = unstandardised(scale, n).inverse();
  VectorXd start(2 * n + 3);
  start.head(2 * n) = turn * near.coefficients;
  const Matrix2d spread =
      turn.topLeftCorner(2, 2) * near.spread * turn.topLeftCorner(2, 2).transpose();
  // The slope by a standard deviation of 0 is zero: start off it.
  const double level = std::max(0.1, std::sqrt(spread(0, 0)));
  const double shared = spread(0, 1) / level;
  start.tail(3) << level, shared, std::sqrt(std::max(0.01, spread(1, 1) - shared * shared));
  return model_at(best_of(probit_loss(placed.participants), {start}, probit_bounds(start.size())),
                  scale, n);
}

std::vector<LevelAnswers> simulate_answers(const std::vector<LevelAnswers>& answers,
                                           const ProbitMixedModel& model, Random& random) {
  std::size_t participants = 0;
  for (const LevelAnswers& one : answers)
    participants = std::max(participants, one.participant + 1);
  const double level = std::sqrt(model.spread(0, 0));
  const double shared = level > 0 ? model.spread(0, 1) / level : 0;
  const double own = std::sqrt(std::max(0.0, model.spread(1, 1) - shared * shared));
  std::vector<Vector2d> effects;
  for (std::size_t i = 0; i < participants; ++i) {
    const double u = random.normal(), v = random.normal();
    effects.emplace_back(level * u, shared * u + own * v);
  }
  std::vector<LevelAnswers> out = answers;
  for (LevelAnswers& one : out) {
    const double eta =
        fixed_part(one, model.coefficients) + design_row(one).dot(effects[one.participant]);
    const double yes = std::exp(upper_tail(-eta).log);
    one.successes = 0;
    for (double i = 0; i < one.trials; ++i) one.successes += random.unit() < yes ? 1 : 0;
  }
  return out;
}

}  // namespace palpate::analysis
