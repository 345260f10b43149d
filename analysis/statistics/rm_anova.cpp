#include "analysis/statistics/rm_anova.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "analysis/statistics/anova.h"

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

}  // namespace palpate::analysis
