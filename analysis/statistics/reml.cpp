#include "analysis/statistics/reml.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoDirection = 1e-13;  // eigenvalues below are 0; the largest possible is 1

/// A participant's cells with one renderer.
struct Level {
  std::vector<Index> cells;
  VectorXd counts, means;
  double squares = 0;  ///< within the cells
};

Level level_of(const ParticipantCells& participant_cells, const ModelCells& cells, std::size_t r,
               std::size_t participant) {
  Level out;
  std::vector<double> counts, means;
  for (std::size_t s = 0; s < cells.shapes.size(); ++s) {
    const ParticipantCell& cell =
        participant_cells[cells.renderers[r]][cells.shapes[s]][participant];
    if (cell.n_used == 0) continue;
    out.cells.push_back(cells.column[r][s]);
    counts.push_back(static_cast<double>(cell.n_used));
    means.push_back(cell.mean_log);
    out.squares += cell.sum_of_squares_log;
  }
  out.counts = Eigen::Map<const VectorXd>(counts.data(), static_cast<Index>(counts.size()));
  out.means = Eigen::Map<const VectorXd>(means.data(), static_cast<Index>(means.size()));
  return out;
}

using Levels = std::vector<std::vector<Level>>;  // [participant][renderer]

/// Basis for one renderer from rows with each participant's direction D^-1/2 counts / sqrt(trials):
/// the eigenvectors of rows' rows with non-zero eigenvalues; X'X within participants is 1 -
/// eigenvalue.
CellDirections directions_of(const Levels& levels, std::size_t r, Index first_cell, Index n_cells,
                             const VectorXd& counts, VectorXd& within) {
  CellDirections out;
  out.first_cell = first_cell;
  const auto present =
      std::count_if(levels.begin(), levels.end(),
                    [&](const std::vector<Level>& all) { return !all[r].cells.empty(); });
  MatrixXd rows = MatrixXd::Zero(static_cast<Index>(present), n_cells);
  Index row = 0;
  for (const auto& all : levels) {
    const Level& level = all[r];
    if (level.cells.empty()) continue;
    const double root = std::sqrt(level.counts.sum());
    for (std::size_t c = 0; c < level.cells.size(); ++c) {
      const Index cell = level.cells[c];
      rows(row, cell - first_cell) =
          level.counts(static_cast<Index>(c)) / (root * std::sqrt(counts(cell)));
    }
    ++row;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(rows.transpose() * rows);
  const auto none = (eigen.eigenvalues().array() <= kNoDirection).count();  // ascending
  out.directions = eigen.eigenvectors().rightCols(n_cells - none);
  within = eigen.eigenvalues().tail(n_cells - none).unaryExpr([](double e) {
    return 1 - e > kNoDirection ? 1 - e : 0.0;
  });
  return out;
}

constexpr int kMaxSteps = 200;
// Participants. With more, the criterion had a single minimum in all tests: two starting values
// suffice as a check.
constexpr std::size_t kFew = 500;
constexpr Index kFewEffects = 3;      // more take long
constexpr double kOnBoundary = 1e-4;  // threshold of a diagonal theta, as in lme4's isSingular()

/// Lambda's lower triangle with a diagonal >= 0 from any root of Lambda Lambda'.
VectorXd theta_of(const MatrixXd& root) {
  const Index q = root.rows();
  const MatrixXd r =
      MatrixXd(root.transpose()).householderQr().matrixQR().triangularView<Eigen::Upper>();
  VectorXd theta(q * (q + 1) / 2);
  Index k = 0;
  for (Index column = 0; column < q; ++column) {
    const double sign = r(column, column) < 0 ? -1 : 1;
    for (Index row = column; row < q; ++row) theta(k++) = sign * r(column, row);
  }
  return theta;
}

std::vector<Index> diagonal(Index q) {
  std::vector<Index> out;
  for (Index column = 0, k = 0; column < q; k += q - column++) out.push_back(k);
  return out;
}

/// Newton step with the absolute values of the Hessian's eigenvalues: a descent direction.
VectorXd newton_step(const RemlPoint& point) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(point.hessian);
  const VectorXd curvature = eigen.eigenvalues().cwiseAbs();
  const double floor = 1e-10 * std::max(curvature.maxCoeff(), 1e-10);
  return -eigen.eigenvectors() * (eigen.eigenvectors().transpose() * point.gradient)
                                     .cwiseQuotient(curvature.cwiseMax(floor));
}

/// Rounding error of the deviance, larger for large effects with a small residual.
double rounding(const RemlOptimum& at) {
  return std::min(
      1e-6, 1e-13 * std::max(1.0, std::fabs(at.point.deviance)) * (1 + at.theta.squaredNorm()));
}

/// Matrices of a participant at a given Psi.
struct Part {
  MatrixXd k;  // (counts^-1 + Psi)^-1 = Z'V^-1 Z
  MatrixXd f;  // K x = Z'V^-1 X
  VectorXd u;  // K (y - x beta)
};

MatrixXd rows_and_columns(const MatrixXd& all, const std::vector<Index>& which) {
  return all(which, which);
}

/// Row and column in Lambda of each theta (lower triangle by columns).
std::vector<std::pair<Index, Index>> lower_triangle_entries(Index levels) {
  std::vector<std::pair<Index, Index>> out;
  for (Index column = 0; column < levels; ++column) {
    for (Index row = column; row < levels; ++row) out.emplace_back(row, column);
  }
  return out;
}

/// Sums over participants of quadratic forms with E, a direction of Psi at the participant's
/// levels.
struct Sums {
  MatrixXd loss;   // F' E F
  VectorXd mixed;  // F' E u
  double squares;  // u' E u
  double traces;   // tr(E (K - F C F'))
};

void put_derivatives(const RemlStatistics& data, const MatrixXd& coding, const VectorXd& theta,
                     const std::vector<Part>& parts, double y_p_y, RemlPoint& out) {
  const Index q = coding.cols(), p = out.beta.size();
  const double degrees_of_freedom = data.degrees_of_freedom;
  const MatrixXd lambda = lower_triangle(theta, q);
  const MatrixXd& c = out.inverse_xx;
  const auto entries = lower_triangle_entries(q);
  const std::size_t n_theta = entries.size();

  std::vector<MatrixXd> unit(n_theta), direction(n_theta);  // d Lambda and d Psi by each theta
  for (std::size_t k = 0; k < n_theta; ++k) {
    unit[k] = MatrixXd::Zero(q, q);
    unit[k](entries[k].first, entries[k].second) = 1;
    const MatrixXd half = coding * unit[k] * lambda.transpose() * coding.transpose();
    direction[k] = half + half.transpose();
  }

  out.slope = MatrixXd::Zero(data.levels, data.levels);
  std::vector<Sums> sums(n_theta, {{}, VectorXd::Zero(p), 0, 0});
  MatrixXd second_trace = MatrixXd::Zero(static_cast<Index>(n_theta), static_cast<Index>(n_theta));
  MatrixXd second_squares = second_trace;  // first term of the second derivative of u' E u
  Index n_rows = 0;
  for (const Part& part : parts) n_rows += part.f.rows();
  // F and E F of all participants stacked: one large matrix product is faster than many small ones.
  MatrixXd all_f(n_rows, p);
  std::vector<MatrixXd> all_ef(n_theta, MatrixXd(n_rows, p));
  for (std::size_t i = 0, row = 0; i < parts.size(); row += data.groups[i++].levels.size()) {
    const Part& part = parts[i];
    const auto& levels = data.groups[i].levels;
    const auto rows = Eigen::seqN(static_cast<Index>(row), part.f.rows());
    all_f(rows, Eigen::all) = part.f;
    const MatrixXd fixed = part.f * c * part.f.transpose();
    const MatrixXd gap = part.k - fixed;
    out.slope(levels, levels) += gap - part.u * part.u.transpose() * (degrees_of_freedom / y_p_y);
    std::vector<MatrixXd> e(n_theta), ke(n_theta);
    for (std::size_t k = 0; k < n_theta; ++k) {
      e[k] = rows_and_columns(direction[k], levels);
      ke[k] = part.k * e[k];
      all_ef[k](rows, Eigen::all) = e[k] * part.f;
      sums[k].mixed.noalias() += part.f.transpose() * (e[k] * part.u);
      sums[k].squares += part.u.dot(e[k] * part.u);
      sums[k].traces += gap.cwiseProduct(e[k]).sum();
    }
    for (std::size_t k = 0; k < n_theta; ++k) {
      for (std::size_t l = 0; l <= k; ++l) {
        const auto a = static_cast<Index>(k), b = static_cast<Index>(l);
        second_trace(a, b) += -(ke[k].transpose().cwiseProduct(ke[l])).sum() +
                              2 * fixed.cwiseProduct(e[k] * ke[l]).sum();
        second_squares(a, b) -= 2 * part.u.dot(e[k] * (ke[l] * part.u));
      }
    }
  }

  const auto m = static_cast<Index>(n_theta);
  out.gradient.resize(m);
  out.hessian.resize(m, m);
  out.full_hessian.resize(m + 1, m + 1);
  std::vector<MatrixXd> c_loss(n_theta);
  for (std::size_t k = 0; k < n_theta; ++k) {
    sums[k].loss.noalias() = all_f.transpose() * all_ef[k];
    c_loss[k].noalias() = c * sums[k].loss;
  }
  const double sigma = std::sqrt(out.sigma_squared);
  for (std::size_t k = 0; k < n_theta; ++k) {
    const auto a = static_cast<Index>(k);
    out.gradient(a) = sums[k].traces - degrees_of_freedom * sums[k].squares / y_p_y;
    for (std::size_t l = 0; l <= k; ++l) {
      const auto b = static_cast<Index>(l);
      const double traces =
          second_trace(a, b) - c_loss[k].transpose().cwiseProduct(c_loss[l]).sum();
      const double squares = second_squares(a, b) + 2 * sums[k].mixed.dot(c * sums[l].mixed);
      const MatrixXd bend = coding *
                            (unit[k] * unit[l].transpose() + unit[l] * unit[k].transpose()) *
                            coding.transpose();
      const double curved = out.slope.cwiseProduct(bend).sum();
      out.full_hessian(a, b) = out.full_hessian(b, a) =
          traces - squares / out.sigma_squared + curved;
      out.hessian(a, b) = out.hessian(b, a) =
          traces -
          degrees_of_freedom *
              (squares / y_p_y + sums[k].squares * sums[l].squares / y_p_y / y_p_y) +
          curved;
    }
    out.full_hessian(a, m) = out.full_hessian(m, a) =
        2 * sums[k].squares / (sigma * out.sigma_squared);
  }
  out.full_hessian(m, m) = 4 * degrees_of_freedom / out.sigma_squared;
  for (Sums& sum : sums) out.information_loss.push_back(std::move(sum.loss));
}

/// Evaluates the criterion. \param coding  levels x effects \param theta lower triangle of Lambda
/// by columns; Psi = coding Lambda Lambda' coding'. With the treatment coding of the levels theta
/// is that of lme4 (Bates et al. 2015).
RemlPoint reml_point(const RemlStatistics& data, const MatrixXd& coding, const VectorXd& theta,
                     bool with_derivatives) {
  const MatrixXd half = coding * lower_triangle(theta, coding.cols());
  const MatrixXd psi = half * half.transpose();
  const Index p = data.within.size();
  const double degrees_of_freedom = data.degrees_of_freedom;

  RemlPoint out;
  std::vector<Part> parts(data.groups.size());
  MatrixXd xx = data.within.asDiagonal();
  VectorXd xy = data.xy;
  double log_determinant = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const RemlParticipant& group = data.groups[i];
    // counts^-1 + Psi = D^-1/2 (1 + D^1/2 Psi D^1/2) D^-1/2 is well conditioned for any Psi, also
    // 0.
    const VectorXd root = group.counts.cwiseSqrt();
    MatrixXd inner = root.asDiagonal() * rows_and_columns(psi, group.levels) * root.asDiagonal();
    inner.diagonal().array() += 1;
    const Eigen::LLT<MatrixXd> factor(inner);
    log_determinant += 2 * factor.matrixLLT().diagonal().array().log().sum();
    const MatrixXd whitened = factor.matrixL().solve(MatrixXd(root.asDiagonal()));
    parts[i].k = whitened.transpose() * whitened;
    parts[i].f = parts[i].k * group.x;
    xx.noalias() += group.x.transpose() * parts[i].f;
    xy.noalias() += parts[i].f.transpose() * group.y;
  }
  const Eigen::LLT<MatrixXd> factor(xx);
  out.beta = factor.solve(xy);
  double y_p_y =
      data.yy - 2 * out.beta.dot(data.xy) + out.beta.dot(data.within.cwiseProduct(out.beta));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const VectorXd rest = data.groups[i].y - data.groups[i].x * out.beta;
    parts[i].u = parts[i].k * rest;
    y_p_y += rest.dot(parts[i].u);
  }
  out.sigma_squared = y_p_y / degrees_of_freedom;
  out.deviance = log_determinant + 2 * factor.matrixLLT().diagonal().array().log().sum() +
                 degrees_of_freedom * (1 + std::log(2 * std::numbers::pi * out.sigma_squared));
  if (with_derivatives) {
    out.inverse_xx = factor.solve(MatrixXd::Identity(p, p));
    put_derivatives(data, coding, theta, parts, y_p_y, out);
  }
  return out;
}

/// Descends from theta until the gradient vanishes. The criterion is even in a diagonal theta, so a
/// starting value on the boundary stays there.
RemlOptimum descend(const RemlStatistics& data, const MatrixXd& coding, VectorXd theta) {
  RemlOptimum out;
  out.theta = std::move(theta);
  out.point = reml_point(data, coding, out.theta, true);
  for (int i = 0; i < kMaxSteps; ++i) {
    const VectorXd step = newton_step(out.point);
    const double promised = -step.dot(out.point.gradient);
    const double noise = rounding(out);
    const double longest = 1 + out.theta.norm();
    double length = std::min(1.0, longest / step.norm());
    RemlPoint next;
    bool lower = false;
    for (int halved = 0; halved < 40 && !lower; ++halved, length /= 2) {
      next = reml_point(data, coding, out.theta + length * step, false);
      lower = next.deviance <= out.point.deviance - 1e-4 * length * promised + noise;
      if (lower) out.theta += length * step;
    }
    if (!lower) break;
    next = reml_point(data, coding, out.theta, true);
    // Near the minimum the deviance is constant up to rounding: a step is accepted if it reduces
    // the gradient.
    const bool done = promised < noise && next.gradient.norm() >= 0.5 * out.point.gradient.norm();
    out.point = std::move(next);
    if (promised < noise) out.converged = true;
    if (done || promised == 0) break;
  }
  return out;
}

/// Among the directions in which Psi is 0, that of steepest descent; none: the Karush-Kuhn-Tucker
/// conditions hold.
VectorXd way_off_boundary(const RemlOptimum& at, const MatrixXd& coding, Index q) {
  const MatrixXd lambda = lower_triangle(at.theta, q);
  const MatrixXd slope = coding.transpose() * at.point.slope * coding;  // by Lambda Lambda'
  const Eigen::SelfAdjointEigenSolver<MatrixXd> psi(lambda * lambda.transpose());
  std::vector<Index> null;
  for (Index i = 0; i < q; ++i) {
    if (psi.eigenvalues()(i) <= kOnBoundary * kOnBoundary) null.push_back(i);
  }
  if (null.empty()) return VectorXd::Zero(q);
  const MatrixXd basis = psi.eigenvectors()(Eigen::all, null);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> reduced(basis.transpose() * slope * basis);
  const double scale = 1e-9 * std::max(1.0, slope.norm());
  if (reduced.eigenvalues()(0) >= -scale) return VectorXd::Zero(q);
  return basis * reduced.eigenvectors().col(0);
}

VectorXd with_small_diagonals_at_zero(VectorXd theta, Index q) {
  for (const Index k : diagonal(q)) {
    if (std::fabs(theta(k)) < kOnBoundary) theta(k) = 0;
  }
  return theta;
}

/// descend(), then leaves the boundary if that lowers the deviance, and sets parameters near 0 to
/// exactly 0.
RemlOptimum optimum_from(const RemlStatistics& data, const MatrixXd& coding,
                         const VectorXd& start) {
  const Index q = coding.cols();
  RemlOptimum best = descend(data, coding, start);
  for (int i = 0; i < 10; ++i) {
    best.theta = theta_of(lower_triangle(best.theta, q));
    const VectorXd snapped = with_small_diagonals_at_zero(best.theta, q);
    if (snapped != best.theta || !best.converged) {
      RemlOptimum on = descend(data, coding, snapped);
      if (on.point.deviance <= best.point.deviance + 1e-8) best = std::move(on);
    }
    const VectorXd away = way_off_boundary(best, coding, q);
    if (away.isZero(0)) break;
    MatrixXd root(q, q + 1);
    root << lower_triangle(best.theta, q), 0.1 * away;
    RemlOptimum off = descend(data, coding, theta_of(root));
    if (off.point.deviance >= best.point.deviance) break;
    best = std::move(off);
  }
  // theta_of() again: a step may have changed the sign of a diagonal.
  best.theta = theta_of(lower_triangle(best.theta, q));
  for (const Index k : diagonal(q)) best.theta(k) = std::fabs(best.theta(k));
  best.point = reml_point(data, coding, best.theta, true);
  best.converged = best.converged && way_off_boundary(best, coding, q).isZero(0);
  return best;
}

/// Moment estimate of Psi: covariance of participants' means minus the part of residual variance.
MatrixXd by_moments(const RemlStatistics& data) {
  const Index q = data.levels;
  const RemlPoint flat =
      reml_point(data, MatrixXd::Identity(q, q), VectorXd::Zero(q * (q + 1) / 2), false);
  double within = std::max(1e-300, (data.yy - 2 * flat.beta.dot(data.xy) +
                                    flat.beta.dot(data.within.cwiseProduct(flat.beta))) /
                                       std::max(1.0, data.degrees_of_freedom));
  MatrixXd products = MatrixXd::Zero(q, q), pairs = products, noise = products;
  for (const RemlParticipant& group : data.groups) {
    const VectorXd rest = group.y - group.x * flat.beta;
    products(group.levels, group.levels) += rest * rest.transpose();
    pairs(group.levels, group.levels).array() += 1;
    for (Index i = 0; i < group.counts.size(); ++i) {
      const Index level = group.levels[static_cast<std::size_t>(i)];
      noise(level, level) += 1 / group.counts(i);
    }
  }
  // With one trial in each level nothing varies within.
  within = std::max(within, 1e-6 * products.trace() / std::max(1.0, pairs.trace()));
  const MatrixXd raw = (products / within - noise).cwiseQuotient(pairs.cwiseMax(1));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(raw);
  const double floor = 1e-3 * std::max(eigen.eigenvalues().maxCoeff(), 1e-2);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(floor).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

ModelCells model_cells(const ParticipantCells& participant_cells) {
  const std::size_t n_shapes = participant_cells.empty() ? 0 : participant_cells[0].size();
  const auto used = [&](std::size_t r, std::size_t s) {
    return std::any_of(participant_cells[r][s].begin(), participant_cells[r][s].end(),
                       [](const ParticipantCell& cell) { return cell.n_used > 0; });
  };
  ModelCells out;
  for (std::size_t r = 0; r < participant_cells.size(); ++r) {
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

VectorXd ReducedModel::to_columns(const VectorXd& scaled) const {
  VectorXd out(data.within.size());
  for (const CellDirections& block : blocks_) {
    out.segment(block.first_column, block.directions.cols()) =
        block.directions.transpose() * scaled.segment(block.first_cell, block.directions.rows());
  }
  return out;
}

VectorXd ReducedModel::to_cells(const VectorXd& columns) const {
  VectorXd out(counts_.size());
  for (const CellDirections& block : blocks_) {
    out.segment(block.first_cell, block.directions.rows()) =
        block.directions * columns.segment(block.first_column, block.directions.cols());
  }
  return out;
}

VectorXd ReducedModel::cell_means(const VectorXd& beta) const {
  return centre_ + to_cells(beta).cwiseQuotient(counts_.cwiseSqrt());
}

ReducedModel::Loading ReducedModel::load(const VectorXd& weights) const {
  const VectorXd scaled = weights.cwiseQuotient(counts_.cwiseSqrt());
  Loading out;
  out.inside = to_columns(scaled);
  out.outside = (scaled - to_cells(out.inside)).squaredNorm();
  return out;
}

ReducedModel::ReducedModel(const ParticipantCells& participant_cells, const ModelCells& cells) {
  const std::size_t q = cells.renderers.size(), n_participants = participant_cells[0][0].size();
  data.levels = static_cast<Index>(q);

  Levels levels(n_participants);
  VectorXd totals = VectorXd::Zero(cells.n);
  counts_ = totals;
  MatrixXd together = MatrixXd::Zero(data.levels, data.levels);
  Index n_levels = 0;
  for (std::size_t i = 0; i < n_participants; ++i) {
    VectorXd has = VectorXd::Zero(data.levels);
    for (std::size_t r = 0; r < q; ++r) {
      const Level& level = levels[i].emplace_back(level_of(participant_cells, cells, r, i));
      if (level.cells.empty()) continue;
      has(static_cast<Index>(r)) = 1;
      ++n_levels;
      totals(level.cells) += level.counts.cwiseProduct(level.means);
      counts_(level.cells) += level.counts;
      scale = std::max(scale, level.means.cwiseAbs().maxCoeff());
    }
    together += has * has.transpose();
  }
  shared = (together.array() > 0).all();
  const double trials = counts_.sum();
  data.degrees_of_freedom = trials - static_cast<double>(cells.n);

  Index n_columns = 0;
  std::vector<VectorXd> within(q);
  for (std::size_t r = 0; r < q; ++r) {
    Index first = 0, n = 0;
    for (const Index cell : cells.column[r]) {
      if (cell >= 0 && n++ == 0) first = cell;
    }
    blocks_.push_back(directions_of(levels, r, first, n, counts_, within[r]));
    blocks_.back().first_column = n_columns;
    n_columns += within[r].size();
  }
  data.within.resize(n_columns);
  for (std::size_t r = 0; r < q; ++r) {
    data.within.segment(blocks_[r].first_column, within[r].size()) = within[r];
  }
  const auto rank = cells.n - n_columns + (data.within.array() > 0).count();
  degrees_of_freedom = trials - static_cast<double>(n_levels + rank);

  // Centres y at the fit with participants x renderers as fixed effects, so that squares of means
  // do not cancel digits of the residuals. Two passes: cell means first, then the remainder of that
  // fit.
  const VectorXd roots = counts_.cwiseSqrt();
  centre_ = totals.cwiseQuotient(counts_);
  for (int pass = 0; pass < 2; ++pass) {
    data.yy = 0;
    data.groups.clear();
    VectorXd xy = VectorXd::Zero(cells.n);  // of deviations from the means, D^-1/2 X'y
    for (const auto& participant : levels) {
      RemlParticipant group;
      std::vector<const Level*> present;
      for (std::size_t r = 0; r < q; ++r) {
        if (participant[r].cells.empty()) continue;
        present.push_back(&participant[r]);
        group.levels.push_back(static_cast<Index>(r));
      }
      if (present.empty()) continue;
      const auto n_present = static_cast<Index>(present.size());
      group.counts.resize(n_present);
      group.y.resize(n_present);
      group.x = MatrixXd::Zero(n_present, n_columns);
      for (Index row = 0; row < n_present; ++row) {
        const Level& level = *present[static_cast<std::size_t>(row)];
        const CellDirections& block =
            blocks_[static_cast<std::size_t>(group.levels[static_cast<std::size_t>(row)])];
        const double n = level.counts.sum();
        const VectorXd y = level.means - centre_(level.cells);
        const double mean_y = level.counts.dot(y) / n;
        const VectorXd rest = y.array() - mean_y;
        group.counts(row) = n;
        group.y(row) = mean_y;
        xy(level.cells) +=
            level.counts.cwiseProduct(rest).cwiseQuotient(VectorXd(roots(level.cells)));
        data.yy += level.squares + level.counts.dot(rest.cwiseAbs2());
        if (pass == 0) continue;
        VectorXd direction = VectorXd::Zero(block.directions.rows());
        for (std::size_t c = 0; c < level.cells.size(); ++c) {
          const Index cell = level.cells[c];
          direction(cell - block.first_cell) =
              level.counts(static_cast<Index>(c)) / (n * roots(cell));
        }
        group.x.block(row, block.first_column, 1, block.directions.cols()) =
            direction.transpose() * block.directions;
      }
      data.groups.push_back(std::move(group));
    }
    data.xy = to_columns(xy);
    if (pass == 0) {
      const VectorXd solved =
          data.xy.binaryExpr(data.within, [](double a, double b) { return b > 0 ? a / b : 0.0; });
      const VectorXd across = xy - to_cells(data.xy);
      centre_ += (across + to_cells(solved)).cwiseQuotient(roots);
    }
  }
  least_square = data.yy;
}

RemlOptimum reml_optimum(const RemlStatistics& data, const MatrixXd& coding) {
  const Index q = coding.cols();
  const MatrixXd inverse = coding.rows() == q
                               ? MatrixXd(coding.inverse())
                               : MatrixXd(coding.completeOrthogonalDecomposition().pseudoInverse());
  const MatrixXd moments = inverse * by_moments(data) * inverse.transpose();
  const VectorXd first = theta_of(moments.llt().matrixL());
  std::vector<VectorXd> starts{first};
  starts.push_back(theta_of(MatrixXd::Identity(q, q)));  // starting value of lme4
  if (data.groups.size() <= kFew && q <= kFewEffects) {
    starts.push_back(theta_of(0.1 * MatrixXd::Identity(q, q)));
    MatrixXd turned = lower_triangle(first, q);  // correlations with the opposite sign
    turned.triangularView<Eigen::StrictlyLower>() *= -1;
    starts.push_back(theta_of(turned));
  }
  RemlOptimum best;
  best.point.deviance = std::numeric_limits<double>::infinity();
  for (const VectorXd& start : starts) {
    RemlOptimum found = optimum_from(data, coding, start);
    const bool better = found.point.deviance < best.point.deviance - 1e-9;
    if (better ||
        (found.converged && !best.converged && found.point.deviance < best.point.deviance + 1e-9)) {
      best = std::move(found);
    }
  }
  return best;
}

MatrixXd lower_triangle(const VectorXd& theta, Index effects) {
  MatrixXd lambda = MatrixXd::Zero(effects, effects);
  Index k = 0;
  for (const auto& [row, column] : lower_triangle_entries(effects))
    lambda(row, column) = theta(k++);
  return lambda;
}

}  // namespace palpate::analysis
