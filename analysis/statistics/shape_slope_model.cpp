#include "analysis/statistics/shape_slope_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "analysis/statistics/bounded_search.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A participant's cells with times: their means are sufficient.
struct CellMeans {
  std::vector<Index> columns;  ///< fixed effect of each
  std::vector<double> r;       ///< -1/2, +1/2
  std::vector<std::size_t> shapes;
  VectorXd counts, means;
};

struct CellData {
  std::vector<CellMeans> participants;
  std::vector<std::vector<Index>> column;  ///< [renderer][shape]; -1: no times
  Index columns = 0;
  double trials = 0, within = 0;  ///< within: sum of squares about the cells' means
};

CellData cell_data(const ParticipantCells& cells) {
  CellData out;
  const std::size_t shapes = cells[0].size(), people = shapes == 0 ? 0 : cells[0][0].size();
  out.column.assign(2, std::vector<Index>(shapes, -1));
  for (std::size_t p = 0; p < people; ++p) {
    CellMeans own;
    std::vector<double> counts, means;
    for (std::size_t r = 0; r < 2; ++r) {
      for (std::size_t s = 0; s < shapes; ++s) {
        const ParticipantCell& cell = cells[r][s][p];
        if (cell.n_used == 0) continue;
        Index& column = out.column[r][s];
        if (column < 0) column = out.columns++;
        own.columns.push_back(column);
        own.r.push_back(r == 0 ? -0.5 : 0.5);
        own.shapes.push_back(s);
        counts.push_back(static_cast<double>(cell.n_used));
        means.push_back(cell.mean_log);
        out.within += cell.sum_of_squares_log;
        out.trials += static_cast<double>(cell.n_used);
      }
    }
    if (own.r.empty()) continue;
    own.counts = Eigen::Map<VectorXd>(counts.data(), static_cast<Index>(counts.size()));
    own.means = Eigen::Map<VectorXd>(means.data(), static_cast<Index>(means.size()));
    out.participants.push_back(std::move(own));
  }
  return out;
}

// Parameters in units of the residual SD: the factor of (a, b) by its lower triangle, the SDs of c
// and g; those taken out are 0.

/// Variance of a participant's cell means over the residual variance.
MatrixXd variance_of(const CellMeans& own, const VectorXd& theta) {
  const auto n = static_cast<Index>(own.r.size());
  MatrixXd out = own.counts.cwiseInverse().asDiagonal();
  const double aa = theta[0] * theta[0], ab = theta[0] * theta[1],
               bb = theta[1] * theta[1] + theta[2] * theta[2];
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k < n; ++k) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(k);
      const double both = own.r[a] * own.r[b];
      out(i, k) += aa + ab * (own.r[a] + own.r[b]) + bb * both;
      if (own.shapes[a] == own.shapes[b])
        out(i, k) += theta[3] * theta[3] + theta[4] * theta[4] * both;
    }
  }
  return out;
}

struct Solved {
  double log_determinants = 0;  ///< of V and of X'V^-1X
  double squares = 0;           ///< weighted residual sum of squares, with those within cells
  VectorXd beta;
  MatrixXd covariance;  ///< of beta, over the residual variance
};

Solved solve(const CellData& data, const VectorXd& theta) {
  Solved out;
  MatrixXd xx = MatrixXd::Zero(data.columns, data.columns);
  VectorXd xy = VectorXd::Zero(data.columns);
  double yy = data.within;
  for (const CellMeans& own : data.participants) {
    const Eigen::LDLT<MatrixXd> factor(variance_of(own, theta));
    const auto n = static_cast<Index>(own.r.size());
    const MatrixXd inverse = factor.solve(MatrixXd::Identity(n, n));
    const VectorXd weighted = inverse * own.means;
    out.log_determinants += factor.vectorD().array().log().sum() + own.counts.array().log().sum();
    yy += own.means.dot(weighted);
    for (Index i = 0; i < n; ++i) {
      const Index column = own.columns[static_cast<std::size_t>(i)];
      xy[column] += weighted[i];
      for (Index k = 0; k < n; ++k)
        xx(column, own.columns[static_cast<std::size_t>(k)]) += inverse(i, k);
    }
  }
  const Eigen::LDLT<MatrixXd> factor(xx);
  out.beta = factor.solve(xy);
  out.covariance = factor.solve(MatrixXd::Identity(data.columns, data.columns));
  out.log_determinants += factor.vectorD().array().log().sum();
  out.squares = yy - xy.dot(out.beta);
  return out;
}

double degrees_of(const CellData& data) { return data.trials - static_cast<double>(data.columns); }

/// -2 log restricted likelihood, with the best residual variance.
double deviance_of(const CellData& data, const VectorXd& theta) {
  const Solved at = solve(data, theta);
  const double df = degrees_of(data);
  return df * (1 + std::log(2 * std::numbers::pi * at.squares / df)) + at.log_determinants;
}

/// The same at a log residual SD.
double deviance_at(const CellData& data, const VectorXd& theta, double log_sigma) {
  const Solved at = solve(data, theta);
  const double df = degrees_of(data);
  return df * (std::log(2 * std::numbers::pi) + 2 * log_sigma) + at.log_determinants +
         at.squares * std::exp(-2 * log_sigma);
}

constexpr double kMostRatio = 1e3;
/// An SD below is 0, over the residual SD.
constexpr double kZeroRatio = 1e-4;

Minimum fit(const CellData& data, bool with_level, bool with_gain) {
  const Objective objective = [&](const VectorXd& theta, VectorXd& gradient) {
    VectorXd moved = theta;
    for (Index i = 0; i < theta.size(); ++i) {
      gradient[i] = 0;
      if ((i == 3 && !with_level) || (i == 4 && !with_gain)) continue;
      const double h = 1e-5 * std::max(0.1, std::abs(theta[i]));
      moved[i] = theta[i] + h;
      const double above = deviance_of(data, moved);
      moved[i] = theta[i] - h;
      gradient[i] = (above - deviance_of(data, moved)) / (2 * h);
      moved[i] = theta[i];
    }
    return deviance_of(data, theta);
  };
  // Even in the SDs: a bound at 0 would stop a search where the slope is 0.
  Bounds bounds{VectorXd::Constant(5, -kMostRatio), VectorXd::Constant(5, kMostRatio)};
  if (!with_level) bounds.low[3] = bounds.high[3] = 0;
  if (!with_gain) bounds.low[4] = bounds.high[4] = 0;
  std::vector<VectorXd> starts;
  for (const auto& [own, shape] :
       {std::pair{0.5, 0.3}, std::pair{1.0, 1.0}, std::pair{0.3, 0.05}}) {
    VectorXd start(5);
    start << own, 0, own / 2, shape, shape;
    starts.push_back(start);
  }
  return best_of(objective, starts, bounds);
}

/// Tests of linear combinations of beta.
class SlopeTester {
 public:
  SlopeTester(const CellData& data, const VectorXd& theta) : data_(data), theta_(theta) {
    best_ = solve(data, theta);
    sigma_ = std::sqrt(best_.squares / degrees_of(data));
    for (Index i = 0; i < theta.size(); ++i) {
      if (std::abs(theta[i]) >= kZeroRatio) free_.push_back(i);
    }
    spread_ = 2 * hessian().completeOrthogonalDecomposition().pseudoInverse();
  }

  double sigma() const { return sigma_; }

  /// Satterthwaite's degrees of freedom: 2 v^2 / var(v), var(v) by the delta method.
  ModelEstimate operator()(const VectorXd& weights) const {
    ModelEstimate out;
    out.estimate = weights.dot(best_.beta);
    const double variance = sigma_ * sigma_ * weights.dot(best_.covariance * weights);
    out.se = std::sqrt(variance);
    const auto n = static_cast<Index>(free_.size());
    VectorXd slope(n + 1);
    for (Index k = 0; k < n; ++k) {
      const auto at = [&](double h) {
        VectorXd moved = theta_;
        moved[free_[static_cast<std::size_t>(k)]] += h;
        return sigma_ * sigma_ * weights.dot(solve(data_, moved).covariance * weights);
      };
      slope[k] = (at(kStep) - at(-kStep)) / (2 * kStep);
    }
    slope[n] = 2 * variance;  // by the log of the residual SD
    const double df = 2 * variance * variance / slope.dot(spread_ * slope);
    if (!(df > 0.5) || !std::isfinite(df)) {
      out.undefined = "Satterthwaite's degrees of freedom cannot be computed";
      return out;
    }
    const boost::math::students_t t(df);
    out.df_satterthwaite = df;
    out.t = *out.estimate / *out.se;
    out.p = std::min(1.0, 2 * cdf(complement(t, std::abs(*out.t))));
    const double half = *out.se * quantile(t, 0.975);
    out.ci95 = Interval{*out.estimate - half, *out.estimate + half};
    return out;
  }

 private:
  static constexpr double kStep = 1e-4;

  MatrixXd hessian() const {
    const auto n = static_cast<Index>(free_.size()) + 1;
    MatrixXd out(n, n);
    const auto at = [&](Index i, double a, Index k, double b) {
      VectorXd theta = theta_;
      double log_sigma = std::log(sigma_);
      for (const auto& [index, move] : {std::pair{i, a}, std::pair{k, b}}) {
        if (index + 1 == n)
          log_sigma += move;
        else
          theta[free_[static_cast<std::size_t>(index)]] += move;
      }
      return deviance_at(data_, theta, log_sigma);
    };
    constexpr double h = 1e-3;
    for (Index i = 0; i < n; ++i) {
      for (Index k = 0; k <= i; ++k)
        out(i, k) = out(k, i) =
            (at(i, h, k, h) - at(i, h, k, -h) - at(i, -h, k, h) + at(i, -h, k, -h)) / (4 * h * h);
    }
    return out;
  }

  const CellData& data_;
  VectorXd theta_;
  Solved best_;
  double sigma_ = 0;
  std::vector<Index> free_;
  MatrixXd spread_;
};

std::string why_no_slopes(const CellData& data) {
  const auto both = [&](std::size_t s) { return data.column[0][s] >= 0 && data.column[1][s] >= 0; };
  std::size_t shapes = 0;
  for (std::size_t s = 0; s < data.column[0].size(); ++s) shapes += both(s) ? 1 : 0;
  if (shapes < 2) return "fewer than two shapes with both renderers";
  const auto people = std::ranges::count_if(data.participants, [](const CellMeans& own) {
    return own.r.front() < 0 && own.r.back() > 0;
  });
  if (people < 3) return "fewer than three participants with both renderers";
  std::size_t cells = 0;
  for (const CellMeans& own : data.participants) cells += own.r.size();
  // Else the residual and the gains by shape are one.
  if (data.trials < 1.5 * static_cast<double>(cells)) return "too few trials of a shape";
  if (!(data.within > 1e-12 * data.trials)) return "no residual variance";
  constexpr std::size_t kMostCells = 4000;
  if (cells > kMostCells || data.columns > 60) return "too many cells for this model";
  return "";
}

}  // namespace

ShapeSlopeModel shape_slope_model(const ParticipantCells& participant_cells) {
  ShapeSlopeModel out;
  if (participant_cells.size() != 2) {
    out.undefined = "for two renderers";
    return out;
  }
  const CellData data = cell_data(participant_cells);
  out.contrasts.resize(participant_cells[0].size());
  out.undefined = why_no_slopes(data);
  if (!out.undefined.empty()) return out;
  bool with_level = true, with_gain = true;
  Minimum found = fit(data, with_level, with_gain);
  if (std::abs(found.place[4]) < kZeroRatio) {
    with_gain = false;
    out.taken_out.emplace_back("participants' gains do not differ between shapes");
    found = fit(data, with_level, with_gain);
  }
  if (std::abs(found.place[3]) < kZeroRatio) {
    with_level = false;
    out.taken_out.emplace_back("participants' levels do not differ between shapes");
    found = fit(data, with_level, with_gain);
  }
  const SlopeTester tested(data, found.place);
  const double sigma = tested.sigma();
  const VectorXd& theta = found.place;
  out.residual_sd = sigma;
  out.participant_level_sd = sigma * std::abs(theta[0]);
  out.participant_gain_sd = sigma * std::hypot(theta[1], theta[2]);
  out.shape_level_sd = with_level ? sigma * std::abs(theta[3]) : 0;
  out.shape_gain_sd = with_gain ? sigma * std::abs(theta[4]) : 0;
  out.log_likelihood_reml = -found.value / 2;
  std::vector<std::optional<double>> p;
  for (std::size_t s = 0; s < out.contrasts.size(); ++s) {
    const Index first = data.column[0][s], second = data.column[1][s];
    if (first < 0 || second < 0) {
      out.contrasts[s].undefined = "no trial of one of the renderers can be used for times";
    } else {
      VectorXd weights = VectorXd::Zero(data.columns);
      weights[first] = -1;
      weights[second] = 1;
      out.contrasts[s] = tested(weights);
    }
    p.push_back(out.contrasts[s].p);
  }
  const auto adjusted = holm(p);
  for (std::size_t s = 0; s < adjusted.size(); ++s) out.contrasts[s].p_holm = adjusted[s];
  return out;
}

}  // namespace palpate::analysis
