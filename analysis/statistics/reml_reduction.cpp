#include "analysis/statistics/reml_reduction.h"

#include <algorithm>
#include <cmath>
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

}  // namespace palpate::analysis
