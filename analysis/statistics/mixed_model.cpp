#include "analysis/statistics/mixed_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "analysis/statistics/anova.h"
#include "analysis/statistics/model_tester.h"
#include "analysis/statistics/reml.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-10;  // relative, of epsilons and eigenvalues

constexpr const char* kFlat = "the effect is equal in all participants (no variance)";

/// Participants' scores on an effect's contrasts, split into their mean and the deviations from it.
struct Scores {
  RowVectorXd mean;
  MatrixXd rest;  // participants x contrasts
  double ss = 0, ss_error = 0;
};

/// \param cells participants x (renderer-major cells)
Scores score(const MatrixXd& cells, const MatrixXd& of_renderer, const MatrixXd& of_shape) {
  const Index n = cells.rows(), p = of_renderer.rows() * of_shape.rows();
  const Index shapes = of_shape.cols();
  MatrixXd weights(cells.cols(), p);
  for (Index i = 0; i < of_renderer.rows(); ++i) {
    for (Index r = 0; r < of_renderer.cols(); ++r) {
      weights.block(r * shapes, i * of_shape.rows(), shapes, of_shape.rows()) =
          of_renderer(i, r) * of_shape.transpose();
    }
  }
  const MatrixXd all = cells * weights;
  Scores out;
  out.mean = all.colwise().mean();
  out.rest = all.rowwise() - out.mean;
  out.ss = static_cast<double>(n) * out.mean.squaredNorm();
  out.ss_error = out.rest.squaredNorm();
  return out;
}

/// Mauchly's W from the eigenvalues of the contrasts' scatter matrix. \param df n - 1
void mauchly(const VectorXd& eigenvalues, double df, double n_cells, Sphericity& out) {
  const auto p = static_cast<double>(eigenvalues.size());
  const double log_w =
      std::min(0.0, eigenvalues.array().log().sum() - p * std::log(eigenvalues.sum() / p));
  const double rho = 1 - (2 * p * p + p + 2) / (6 * p * df);
  const double z = -df * rho * log_w, f = p * (p + 1) / 2 - 1;
  const double first = cdf(complement(boost::math::chi_squared(f), z));
  const double next = cdf(complement(boost::math::chi_squared(f + 4), z));
  const auto series = [&](double in_doubt) {
    const double second = (p + 2) * (p - 1) * (p - 2) *
                          (2 * p * p * p + 6 * p * p + 3 * in_doubt + 2) /
                          (288 * std::pow(df * p * rho, 2));
    return std::clamp(first + second * (next - first), 0.0, 1.0);
  };
  out.mauchly_w = std::exp(log_w);
  out.mauchly_p = series(n_cells);
  out.mauchly_p_box = series(p);
}

void add_reason(std::string& reasons, const char* reason) {
  reasons += (reasons.empty() ? "" : "; ") + std::string(reason);
}

Sphericity sphericity(const Scores& scores, double n_cells, const AnovaEffect& effect) {
  Sphericity out;
  const auto n = static_cast<double>(scores.rest.rows());
  const auto p = static_cast<double>(scores.rest.cols());
  if (p < 2) {
    out.undefined = "one degree of freedom: nothing to test or to correct";
    return out;
  }
  if (!effect.undefined.empty()) {
    out.undefined = effect.undefined;
    return out;
  }
  // Use the smaller of X X' and X'X, which have the same non-zero eigenvalues.
  const bool wide = scores.rest.cols() > scores.rest.rows();
  const MatrixXd scatter = wide ? MatrixXd(scores.rest * scores.rest.transpose())
                                : MatrixXd(scores.rest.transpose() * scores.rest);
  const double e = std::min(1.0, scatter.trace() * scatter.trace() / (p * scatter.squaredNorm()));
  out.gg_epsilon = e;
  out.gg_p = f_upper_tail(*effect.f, *effect.num_df * e, *effect.den_df * e);
  if (n - 1 < p) {
    add_reason(out.undefined, "Mauchly's test needs more participants than degrees of freedom");
  } else {
    const VectorXd eigenvalues =
        Eigen::SelfAdjointEigenSolver<MatrixXd>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
    if (eigenvalues.minCoeff() <= 1e-14 * eigenvalues.maxCoeff()) {
      add_reason(out.undefined, "Mauchly's test: some contrast of the effect does not vary");
    } else {
      mauchly(eigenvalues, n - 1, n_cells, out);
    }
  }
  const double denominator = n - 1 - p * e;  // >= 0 up to rounding
  if (denominator <= kRounding * n) {
    add_reason(out.undefined, "Huynh and Feldt's epsilon: too few participants");
  } else {
    out.hf_epsilon_raw = (n * p * e - 2) / (p * denominator);
    out.hf_epsilon_used = std::min(1.0, *out.hf_epsilon_raw);
    out.hf_p = f_upper_tail(*effect.f, *effect.num_df * *out.hf_epsilon_used,
                            *effect.den_df * *out.hf_epsilon_used);
  }
  return out;
}

void test(const Scores& scores, double all_error, double n_cells, AnovaEffect& effect) {
  const auto n = static_cast<double>(scores.rest.rows());
  const auto p = static_cast<double>(scores.rest.cols());
  effect.num_df = p;
  effect.den_df = p * (n - 1);
  const double spread = std::sqrt(scores.ss_error / *effect.den_df);
  const double scale = kNoVariance * std::max(1.0, scores.mean.norm());
  if (spread <= scale) {
    effect.undefined = kFlat;
  } else {
    effect.f = (scores.ss / p) / (scores.ss_error / *effect.den_df);
    effect.p = f_upper_tail(*effect.f, p, *effect.den_df);
  }
  // Eta squared is 0 / 0 without any variance.
  if (std::sqrt((scores.ss + all_error) / n) > kNoVariance) {
    effect.generalized_eta_squared = scores.ss / (scores.ss + all_error);
  }
  effect.sphericity = sphericity(scores, n_cells, effect);
}

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

RmAnova rm_anova(const ParticipantCells& participant_cells) {
  RmAnova out;
  constexpr std::array kNames{"renderer", "shape", "renderer:shape"};
  for (std::size_t i = 0; i < kNames.size(); ++i) out.effects[i].name = kNames[i];
  const std::size_t n_renderers = participant_cells.size();
  const std::size_t n_shapes = n_renderers == 0 ? 0 : participant_cells[0].size();
  const std::size_t n_participants = n_shapes == 0 ? 0 : participant_cells[0][0].size();
  const auto cell = [&](std::size_t p, std::size_t c) -> const ParticipantCell& {
    return participant_cells[c / n_shapes][c % n_shapes][p];
  };
  std::vector<std::size_t> complete;
  for (std::size_t p = 0; p < n_participants; ++p) {
    bool all = true;
    for (std::size_t c = 0; all && c < n_renderers * n_shapes; ++c) all = cell(p, c).n_used > 0;
    (all ? complete : out.dropped).push_back(p);
  }
  out.n_participants_used = complete.size();

  const auto refuse = [&](std::size_t effect, const std::string& reason) {
    out.effects[effect].undefined = out.effects[effect].sphericity.undefined = reason;
  };
  if (complete.size() < 2) {
    out.undefined = complete.empty() ? "no participant has a time in every cell"
                                     : "one participant, so no variance between participants";
    for (std::size_t i = 0; i < kNames.size(); ++i) refuse(i, out.undefined);
    return out;
  }
  if (n_renderers < 2) out.undefined = "only one renderer in the data";
  if (n_shapes < 2) add_reason(out.undefined, "only one shape in the data");

  MatrixXd cells(static_cast<Index>(complete.size()), static_cast<Index>(n_renderers * n_shapes));
  for (Index i = 0; i < cells.rows(); ++i) {
    for (Index c = 0; c < cells.cols(); ++c) {
      cells(i, c) =
          cell(complete[static_cast<std::size_t>(i)], static_cast<std::size_t>(c)).mean_log;
    }
  }
  const auto renderers = static_cast<Index>(n_renderers), shapes = static_cast<Index>(n_shapes);
  const std::array<Scores, 3> scores{
      score(cells, helmert_contrasts(renderers), unit_average(shapes)),
      score(cells, unit_average(renderers), helmert_contrasts(shapes)),
      score(cells, helmert_contrasts(renderers), helmert_contrasts(shapes))};
  double all_error = score(cells, unit_average(renderers), unit_average(shapes)).ss_error;
  for (const Scores& effect : scores) all_error += effect.ss_error;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (scores[i].rest.cols() == 0) {
      refuse(i, out.undefined);
    } else {
      test(scores[i], all_error, static_cast<double>(cells.cols()), out.effects[i]);
    }
  }
  if (out.undefined.empty() && std::ranges::all_of(out.effects, [](const AnovaEffect& effect) {
        return !effect.undefined.empty();
      })) {
    out.undefined = kFlat;
    // Without error variance eta squared would be 1 for any difference.
    for (AnovaEffect& effect : out.effects) effect.generalized_eta_squared.reset();
  }
  return out;
}

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
