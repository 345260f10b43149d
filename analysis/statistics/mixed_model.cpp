#include "analysis/statistics/mixed_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>

#include "analysis/statistics/model_tester.h"
#include "analysis/statistics/reml.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kMaxModelRenderers = 8;

/// Cost of one evaluation of the derivatives: a product of cells x cells matrices for each
/// parameter of the random effects' covariance.
double model_work(std::size_t renderers, Index cells) {
  const auto q = static_cast<double>(renderers), n = static_cast<double>(cells);
  return q * (q + 1) / 2 * n * n * n;
}

/// Treatment coding: columns in R's order, as values at the non-empty cells.
struct Columns {
  std::vector<std::string> names, left_out;
  MatrixXd values;  ///< cells x columns, square
};

Columns treatment_columns(const ModelCells& cells, const std::vector<std::string>& renderers,
                          const std::vector<std::string>& shapes) {
  Columns out;
  out.values.resize(cells.n, cells.n);
  MatrixXd basis(cells.n, cells.n);
  Index rank = 0;
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
    // As in R, a column that depends linearly on those before it is left out.
    VectorXd rest = column;
    for (int again = 0; again < 2; ++again) {
      const VectorXd known = basis.leftCols(rank).transpose() * rest;
      rest.noalias() -= basis.leftCols(rank) * known;
    }
    if (rest.norm() <= 1e-7 * column.norm()) {
      out.left_out.push_back(name);
      return;
    }
    out.names.push_back(name);
    out.values.col(rank) = column;
    basis.col(rank++) = rest.normalized();
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
      if (sd < kZero || psi(k, k) < kZero * kZero) {
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
    if (reason.empty()) add("participants' effects have a covariance of lower rank");
    out.singular = reason;
  }
}

std::string why_no_fit(const ParticipantCells& participant_cells, const ModelCells& cells) {
  if (participant_cells.size() < 2) return "only one renderer in the data";
  if (cells.n == 0) return "no trial can be used for times";
  if (cells.renderers.size() < participant_cells.size())
    return "no trial with one of the renderers can be used for times";
  if (participant_cells.size() > kMaxModelRenderers ||
      model_work(participant_cells.size(), cells.n) > model_work(2, 400)) {
    return "too many renderers and shapes for this model";
  }
  return {};
}

/// Why these data have no fit.
std::string why_not_fitted(const ReducedModel& prepared, std::size_t renderers) {
  if (prepared.data.groups.size() < 2)
    return "one participant, so no variance between participants";
  if (!prepared.shared) {
    return renderers == 2 ? "no participant has times for both renderers"
                          : "two of the renderers have no participant with times for both";
  }
  if (prepared.degrees_of_freedom < 1) return "too few trials to estimate the residual variance";
  if (std::sqrt(prepared.least_square / prepared.degrees_of_freedom) <=
      1e-10 * std::max(1.0, prepared.scale))
    return "no residual variance: participants and shapes explain every time";
  return {};
}

/// Treatment coding of the random effects: the first renderer and the differences from it.
MatrixXd random_coding(std::size_t renderers) {
  MatrixXd coding =
      MatrixXd::Identity(static_cast<Index>(renderers), static_cast<Index>(renderers));
  coding.col(0).setOnes();
  return coding;
}

}  // namespace

MixedModel mixed_model(const ParticipantCells& participant_cells,
                       const std::vector<std::string>& renderers,
                       const std::vector<std::string>& shapes) {
  MixedModel out;
  const ModelCells cells = model_cells(participant_cells);
  for (const auto& renderer : participant_cells) {
    for (const auto& shape : renderer) {
      for (const ParticipantCell& cell : shape) out.n_observations += cell.n_used;
    }
  }
  ModelEstimate nothing;
  const auto refuse = [&](const std::string& reason) {
    out.undefined = nothing.undefined = reason;
    out.contrasts.assign(std::max<std::size_t>(participant_cells.size(), 2) - 1,
                         std::vector<ModelEstimate>(shapes.size(), nothing));
    return out;
  };
  if (const std::string reason = why_no_fit(participant_cells, cells); !reason.empty())
    return refuse(reason);
  const ReducedModel prepared(participant_cells, cells);
  out.n_participants = prepared.data.groups.size();
  if (const std::string reason = why_not_fitted(prepared, participant_cells.size());
      !reason.empty())
    return refuse(reason);
  const RemlOptimum optimum = reml_optimum(prepared.data, random_coding(participant_cells.size()));
  if (!optimum.converged) return refuse("the fit did not converge");

  const Columns columns = treatment_columns(cells, renderers, shapes);
  // The change of basis has determinant 1 or -1 (incidence matrix and unit vectors), so the
  // likelihood is unchanged.
  const MatrixXd from_cells = columns.values.inverse();
  out.log_likelihood_reml = -(optimum.point.deviance + prepared.log_determinant()) / 2;
  out.left_out = columns.left_out;
  put_variances(optimum, renderers, out);

  const ModelTester tested(prepared, optimum.point);
  for (Index i = 0; i < cells.n; ++i) {
    out.fixed_effects.push_back(
        {columns.names[static_cast<std::size_t>(i)], tested(from_cells.row(i).transpose())});
  }
  nothing.undefined = "no trial of one of the renderers can be used for times";
  std::vector<std::optional<double>> p;
  for (std::size_t r = 1; r < participant_cells.size(); ++r) {
    std::vector<ModelEstimate> contrasts(shapes.size(), nothing);
    for (std::size_t s = 0; s < cells.shapes.size(); ++s) {
      const Index first = cells.column[0][s], other = cells.column[r][s];
      if (first < 0 || other < 0) continue;
      VectorXd weights = VectorXd::Zero(cells.n);
      weights(other) = 1;
      weights(first) = -1;
      contrasts[cells.shapes[s]] = tested(weights);
    }
    for (const ModelEstimate& contrast : contrasts) p.push_back(contrast.p);
    out.contrasts.push_back(std::move(contrasts));
  }
  const auto adjusted = holm(p);
  std::size_t test = 0;
  for (auto& contrasts : out.contrasts) {
    for (ModelEstimate& contrast : contrasts) contrast.p_holm = adjusted[test++];
  }
  return out;
}

}  // namespace palpate::analysis
