#include "analysis/mixed_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>

#include "analysis/reml.h"

namespace palpate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The non-empty cells are the columns of X: any coding of renderer * shape spans the same.
struct Cells {
  std::vector<std::size_t> renderers, shapes;  ///< those with a time, in order
  /// [renderer][shape] of these: column of X, -1 for an empty cell
  std::vector<std::vector<Index>> column;
  Index n = 0;
};

Cells cells_of(const People& people) {
  const std::size_t n_shapes = people.empty() ? 0 : people[0].size();
  const auto used = [&](std::size_t r, std::size_t s) {
    return std::any_of(people[r][s].begin(), people[r][s].end(),
                       [](const ParticipantCell& cell) { return cell.n_used > 0; });
  };
  Cells out;
  for (std::size_t r = 0; r < people.size(); ++r) {
    for (std::size_t s = 0; s < n_shapes; ++s) {
      if (!used(r, s)) continue;
      if (out.renderers.empty() || out.renderers.back() != r) out.renderers.push_back(r);
      if (std::find(out.shapes.begin(), out.shapes.end(), s) == out.shapes.end()) {
        out.shapes.push_back(s);
      }
    }
  }
  std::sort(out.shapes.begin(), out.shapes.end());
  for (const std::size_t r : out.renderers) {
    auto& row = out.column.emplace_back();
    for (const std::size_t s : out.shapes) row.push_back(used(r, s) ? out.n++ : -1);
  }
  return out;
}

/// Everything that the criterion needs, from one pass over participants' cells.
struct Prepared {
  RemlData data;
  VectorXd centre;          ///< what was subtracted from y, by cell
  double freedom = 0;       ///< trials less the rank of X and Z together
  double least_square = 0;  ///< residual sum of squares with participants as fixed effects
  double scale = 0;         ///< largest |mean log|
  bool shared = true;       ///< every pair of renderers has a participant who has both
};

/// A participant's cells with one renderer, relative to a centre.
struct Level {
  std::vector<Index> columns;
  VectorXd counts, means;
  double squares = 0;  ///< within the cells
};

Level level_of(const People& people, const Cells& cells, std::size_t r, std::size_t participant) {
  Level out;
  std::vector<double> counts, means;
  for (std::size_t s = 0; s < cells.shapes.size(); ++s) {
    const ParticipantCell& cell = people[cells.renderers[r]][cells.shapes[s]][participant];
    if (cell.n_used == 0) continue;
    out.columns.push_back(cells.column[r][s]);
    counts.push_back(static_cast<double>(cell.n_used));
    means.push_back(cell.mean_log);
    out.squares += cell.squares_log;
  }
  out.counts = Eigen::Map<const VectorXd>(counts.data(), static_cast<Index>(counts.size()));
  out.means = Eigen::Map<const VectorXd>(means.data(), static_cast<Index>(means.size()));
  return out;
}

Prepared prepare(const People& people, const Cells& cells) {
  Prepared out;
  RemlData& data = out.data;
  const std::size_t q = cells.renderers.size(), n_people = people[0][0].size();
  data.levels = static_cast<Index>(q);
  data.xx = MatrixXd::Zero(cells.n, cells.n);
  data.xy = VectorXd::Zero(cells.n);

  std::vector<std::vector<Level>> levels(n_people);  // [participant][renderer]
  VectorXd totals = VectorXd::Zero(cells.n), counts = totals;
  MatrixXd together = MatrixXd::Zero(data.levels, data.levels);
  Index n_levels = 0;
  for (std::size_t i = 0; i < n_people; ++i) {
    VectorXd has = VectorXd::Zero(data.levels);
    for (std::size_t r = 0; r < q; ++r) {
      const Level& level = levels[i].emplace_back(level_of(people, cells, r, i));
      if (level.columns.empty()) continue;
      has(static_cast<Index>(r)) = 1;
      ++n_levels;
      totals(level.columns) += level.counts.cwiseProduct(level.means);
      counts(level.columns) += level.counts;
      out.scale = std::max(out.scale, level.means.cwiseAbs().maxCoeff());
    }
    together += has * has.transpose();
  }
  out.shared = (together.array() > 0).all();
  data.observations = counts.sum();

  // Centred at the fit with participants x renderers as fixed effects: what is left is of the size
  // of the noise, so no digits are lost to the squares of the means. Twice: once to the cells'
  // means, then to the rest of that fit.
  out.centre = totals.cwiseQuotient(counts);
  for (int pass = 0; pass < 2; ++pass) {
    data.xx.setZero();
    data.xy.setZero();
    data.yy = 0;
    data.groups.clear();
    for (std::size_t i = 0; i < n_people; ++i) {
      RemlGroup group;
      const auto present = static_cast<Index>(
          std::count_if(levels[i].begin(), levels[i].end(),
                        [](const Level& level) { return !level.columns.empty(); }));
      if (present == 0) continue;
      group.counts.resize(present);
      group.y.resize(present);
      group.x = MatrixXd::Zero(present, cells.n);
      for (std::size_t r = 0; r < q; ++r) {
        const Level& level = levels[i][r];
        if (level.columns.empty()) continue;
        const auto row = static_cast<Index>(group.levels.size());
        group.levels.push_back(static_cast<Index>(r));
        const double n = level.counts.sum();
        const VectorXd share = level.counts / n, y = level.means - out.centre(level.columns);
        const double mean_y = share.dot(y);
        const VectorXd rest = y.array() - mean_y;
        group.counts(row) = n;
        group.y(row) = mean_y;
        group.x(row, level.columns) = share.transpose();
        MatrixXd xx = -n * share * share.transpose();
        xx.diagonal() += level.counts;
        data.xx(level.columns, level.columns) += xx;
        data.xy(level.columns) += level.counts.cwiseProduct(rest);
        data.yy += level.squares + level.counts.dot(rest.cwiseAbs2());
      }
      data.groups.push_back(std::move(group));
    }
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> fit(data.xx);
    if (pass == 0) {
      out.centre += fit.solve(data.xy);
      out.freedom = data.observations - static_cast<double>(n_levels + fit.rank());
    }
  }
  out.least_square = data.yy;
  return out;
}

/// Treatment coding: its columns in R's order, each as values at the non-empty cells.
struct Columns {
  std::vector<std::string> names, left_out;
  MatrixXd values;  ///< cells x columns, square
};

Columns treatment_columns(const Cells& cells, const std::vector<std::string>& renderers,
                          const std::vector<std::string>& shapes) {
  Columns out;
  out.values.resize(cells.n, 0);
  MatrixXd basis(cells.n, 0);
  const auto add = [&](const std::string& name, std::size_t renderer, std::size_t shape) {
    VectorXd column = VectorXd::Zero(cells.n);
    for (std::size_t r = 0; r < cells.renderers.size(); ++r) {
      for (std::size_t s = 0; s < cells.shapes.size(); ++s) {
        if (cells.column[r][s] >= 0 && (renderer == 0 || r == renderer) &&
            (shape == 0 || s == shape)) {
          column(cells.column[r][s]) = 1;
        }
      }
    }
    // As R does: a column that follows from those before it is left out.
    VectorXd rest = column;
    for (int again = 0; again < 2; ++again) rest -= basis * (basis.transpose() * rest);
    if (rest.norm() <= 1e-7 * column.norm()) {
      out.left_out.push_back(name);
      return;
    }
    out.names.push_back(name);
    out.values.conservativeResize(Eigen::NoChange, out.values.cols() + 1);
    out.values.rightCols(1) = column;
    basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
    basis.rightCols(1) = rest.normalized();
  };
  const auto renderer_name = [&](std::size_t r) {
    return "renderer" + renderers[cells.renderers[r]];
  };
  const auto shape_name = [&](std::size_t s) { return "shape" + shapes[cells.shapes[s]]; };
  add("(Intercept)", 0, 0);
  for (std::size_t r = 1; r < cells.renderers.size(); ++r) add(renderer_name(r), r, 0);
  for (std::size_t s = 1; s < cells.shapes.size(); ++s) add(shape_name(s), 0, s);
  for (std::size_t s = 1; s < cells.shapes.size(); ++s) {
    for (std::size_t r = 1; r < cells.renderers.size(); ++r) {
      add(renderer_name(r) + ":" + shape_name(s), r, s);
    }
  }
  return out;
}

/// Inverse of the full Hessian, without the directions in which the criterion is flat.
MatrixXd inverse_of_curved(const MatrixXd& hessian) {
  const VectorXd scale =
      hessian.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scale.asDiagonal() * hessian *
                                                      scale.asDiagonal());
  const VectorXd inverse =
      eigen.eigenvalues().unaryExpr([](double e) { return e > 1e-10 ? 1 / e : 0.0; });
  return scale.asDiagonal() * eigen.eigenvectors() * inverse.asDiagonal() *
         eigen.eigenvectors().transpose() * scale.asDiagonal();
}

/// Estimates and tests linear functions of the cells' means.
class Tester {
 public:
  Tester(const RemlPoint& point, VectorXd means)
      : point_(point),
        means_(std::move(means)),
        spread_(2 * inverse_of_curved(point.full_hessian)) {}

  /// Satterthwaite (1946) as in lmerTest (Kuznetsova et al. 2017): the variance's own variance by
  /// the delta method from the curvature of the likelihood in (theta, sigma).
  ModelEstimate operator()(const VectorXd& weights) const {
    ModelEstimate out;
    out.estimate = weights.dot(means_);
    const VectorXd loaded = point_.inverse_xx * weights;
    const double variance = point_.sigma_squared * weights.dot(loaded);
    out.se = std::sqrt(variance);
    const auto n_theta = static_cast<Index>(point_.information_loss.size());
    VectorXd slope(n_theta + 1);
    for (Index k = 0; k < n_theta; ++k) {
      slope(k) = point_.sigma_squared *
                 loaded.dot(point_.information_loss[static_cast<std::size_t>(k)] * loaded);
    }
    slope(n_theta) = 2 * variance / std::sqrt(point_.sigma_squared);
    const double df = 2 * variance * variance / slope.dot(spread_ * slope);
    namespace bm = boost::math;
    using Gentle = bm::policies::policy<bm::policies::overflow_error<bm::policies::ignore_error>>;
    if (!(df > 0) || !std::isfinite(df)) {
      out.undefined = "Satterthwaite's degrees of freedom cannot be computed";
      return out;
    }
    out.df_satterthwaite = df;
    const bm::students_t_distribution<double, Gentle> distribution(df);
    const double half = *out.se * quantile(distribution, 0.975);
    if (!std::isfinite(half)) {
      out.undefined = "too few degrees of freedom";
      return out;
    }
    out.t = *out.estimate / *out.se;
    out.p = std::min(1.0, 2 * cdf(complement(distribution, std::fabs(*out.t))));
    out.ci95 = Interval{*out.estimate - half, *out.estimate + half};
    return out;
  }

 private:
  const RemlPoint& point_;
  VectorXd means_;
  MatrixXd spread_;
};

void put_variances(const RemlOptimum& optimum, const std::vector<std::string>& renderers,
                   MixedModel& out) {
  constexpr double kZero = 1e-4;  // relative to the residual sd, as lme4's isSingular()
  const double sigma = std::sqrt(optimum.point.sigma_squared);
  out.residual_sd = sigma;
  const auto q = static_cast<Index>(renderers.size());
  const MatrixXd lambda = lower_triangle(optimum.theta, q);
  const MatrixXd psi = lambda * lambda.transpose();
  bool zero_sd = false, zero_diagonal = false;
  std::string reason;
  const auto add = [&](const std::string& what) { reason += (reason.empty() ? "" : "; ") + what; };
  for (Index i = 0; i < q; ++i) {
    const double sd = std::sqrt(psi(i, i));
    out.random_sds.push_back(sigma * sd);
    zero_diagonal = zero_diagonal || lambda(i, i) < kZero;
    if (sd < kZero) {
      zero_sd = true;
      add(i == 0 ? "participants' intercepts do not vary"
                 : "participants' slopes for " + renderers[static_cast<std::size_t>(i)] +
                       " do not vary");
    }
    for (Index k = 0; k < i; ++k) {
      const double both = std::sqrt(psi(i, i) * psi(k, k));
      if (both == 0) {
        out.random_correlations.emplace_back();
        continue;
      }
      const double correlation = std::clamp(psi(i, k) / both, -1.0, 1.0);
      out.random_correlations.emplace_back(correlation);
      if (std::fabs(correlation) > 1 - 1e-9) {
        add(correlation > 0 ? "a correlation of +1 between participants' effects"
                            : "a correlation of -1 between participants' effects");
      }
    }
  }
  if (zero_diagonal || zero_sd) {
    if (reason.empty()) add("participants' effects lie in fewer dimensions than there are");
    out.singular = reason;
  }
}

std::string why_no_fit(const People& people, const Cells& cells) {
  if (people.size() < 2) return "only one renderer in the data";
  if (cells.n == 0) return "no trial can be used for times";
  if (cells.renderers.size() < people.size())
    return "no trial with one of the renderers can be used for times";
  return {};
}

}  // namespace

MixedModel mixed_model(const People& people, const std::vector<std::string>& renderers,
                       const std::vector<std::string>& shapes) {
  MixedModel out;
  const Cells cells = cells_of(people);
  for (const auto& renderer : people) {
    for (const auto& shape : renderer) {
      for (const ParticipantCell& cell : shape) out.n_observations += cell.n_used;
    }
  }
  ModelEstimate nothing;
  const auto refuse = [&](const std::string& reason) {
    out.undefined = nothing.undefined = reason;
    out.contrasts.assign(std::max<std::size_t>(people.size(), 2) - 1,
                         std::vector<ModelEstimate>(shapes.size(), nothing));
    return out;
  };
  if (const std::string reason = why_no_fit(people, cells); !reason.empty()) return refuse(reason);
  const Prepared prepared = prepare(people, cells);
  out.n_participants = prepared.data.groups.size();
  if (out.n_participants < 2) return refuse("one participant cannot tell chance from effect");
  if (!prepared.shared) return refuse("no participant has times for both renderers");
  if (prepared.freedom < 1) {
    return refuse("too few trials: none is left to tell the residual variance");
  }
  if (std::sqrt(prepared.least_square / prepared.freedom) <=
      1e-10 * std::max(1.0, prepared.scale)) {
    return refuse("no residual variance: participants and shapes explain every time");
  }

  const auto q = static_cast<Index>(people.size());
  MatrixXd coding = MatrixXd::Identity(q, q);
  coding.col(0).setOnes();
  const RemlOptimum optimum = reml_optimum(prepared.data, coding);
  if (!optimum.converged) return refuse("the fit did not converge");

  const Columns columns = treatment_columns(cells, renderers, shapes);
  const Eigen::FullPivLU<MatrixXd> lu(columns.values);
  const MatrixXd from_cells = lu.inverse();
  out.log_likelihood_reml =
      -(optimum.point.deviance + 2 * std::log(std::fabs(lu.determinant()))) / 2;
  out.left_out = columns.left_out;
  put_variances(optimum, renderers, out);

  const Tester tested(optimum.point, prepared.centre + optimum.point.beta);
  for (Index i = 0; i < cells.n; ++i) {
    out.fixed_effects.push_back(
        {columns.names[static_cast<std::size_t>(i)], tested(from_cells.row(i).transpose())});
  }
  nothing.undefined = "no trial of one of the renderers can be used for times";
  for (std::size_t r = 1; r < people.size(); ++r) {
    std::vector<ModelEstimate> contrasts(shapes.size(), nothing);
    std::vector<std::optional<double>> p(shapes.size());
    for (std::size_t s = 0; s < cells.shapes.size(); ++s) {
      const Index first = cells.column[0][s], other = cells.column[r][s];
      if (first < 0 || other < 0) continue;
      VectorXd weights = VectorXd::Zero(cells.n);
      weights(other) = 1;
      weights(first) = -1;
      contrasts[cells.shapes[s]] = tested(weights);
      p[cells.shapes[s]] = contrasts[cells.shapes[s]].p;
    }
    const auto adjusted = holm(p);
    for (std::size_t s = 0; s < contrasts.size(); ++s) contrasts[s].p_holm = adjusted[s];
    out.contrasts.push_back(std::move(contrasts));
  }
  return out;
}

}  // namespace palpate
