// What the REML criterion is reduced to, against dense matrices of all trials.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/statistics/reml.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {
namespace reductions {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Trials as rows of X (cells) and Z (participants x renderers); columns without trials are zero.
struct DenseTrials {
  ParticipantCells cells;
  MatrixXd x, z;
  VectorXd y;
};

/// \param most  trials of a cell; about a third of the cells have none
DenseTrials draw_trials(std::size_t renderers, std::size_t shapes, std::size_t participants,
                        std::uint64_t most, std::uint64_t seed) {
  Random random(seed);
  DenseTrials out;
  out.cells.assign(renderers, {shapes, std::vector<ParticipantCell>(participants)});
  std::vector<std::array<Index, 2>> rows;
  std::vector<double> y;
  for (std::size_t r = 0; r < renderers; ++r) {
    for (std::size_t s = 0; s < shapes; ++s) {
      for (std::size_t p = 0; p < participants; ++p) {
        ParticipantCell& cell = out.cells[r][s][p];
        if (random.below(3) == 0) continue;
        cell.n_used = 1 + random.below(most);
        const std::size_t first = y.size();
        for (std::size_t i = 0; i < cell.n_used; ++i) {
          rows.push_back(
              {static_cast<Index>(r * shapes + s), static_cast<Index>(r * participants + p)});
          y.push_back(1 + 0.3 * random.normal());
          cell.mean_log += y.back() / static_cast<double>(cell.n_used);
        }
        for (std::size_t i = first; i < y.size(); ++i)
          cell.sum_of_squares_log += (y[i] - cell.mean_log) * (y[i] - cell.mean_log);
      }
    }
  }
  const auto n = static_cast<Index>(y.size());
  out.x = MatrixXd::Zero(n, static_cast<Index>(renderers * shapes));
  out.z = MatrixXd::Zero(n, static_cast<Index>(renderers * participants));
  for (Index i = 0; i < n; ++i) {
    out.x(i, rows[static_cast<std::size_t>(i)][0]) = 1;
    out.z(i, rows[static_cast<std::size_t>(i)][1]) = 1;
  }
  out.y = Eigen::Map<const VectorXd>(y.data(), n);
  return out;
}

// A tall product is summed in blocks that Eigen fits to this machine's caches, unless it is kept
// from asking.
TEST(Matrices, AreSummedInOneOrderOnEveryMachine) {
  EXPECT_EQ(Eigen::l1CacheSize(), 32 * 1024);
  EXPECT_EQ(Eigen::internal::packet_traits<double>::size, 1);
}

TEST(ReducedModel, KeepsDenseModelsDegreesOfFreedomAndResiduals) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const std::size_t renderers = 2 + seed % 3, shapes = 1 + seed % 5, participants = 2 + seed % 7;
    const DenseTrials trials = draw_trials(renderers, shapes, participants, 1 + seed % 4, seed);
    if (trials.y.size() == 0) continue;
    const ReducedModel reduced(trials.cells, model_cells(trials.cells));
    MatrixXd both(trials.x.rows(), trials.x.cols() + trials.z.cols());
    both << trials.x, trials.z;
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> of_both(both), of_x(trials.x);
    const auto n = static_cast<double>(trials.y.size());
    EXPECT_EQ(reduced.degrees_of_freedom, n - static_cast<double>(of_both.rank())) << seed;
    EXPECT_EQ(reduced.data.degrees_of_freedom, n - static_cast<double>(of_x.rank())) << seed;
    const VectorXd fit = of_both.solve(trials.y);
    ASSERT_NEAR(reduced.least_square, (trials.y - both * fit).squaredNorm(), 1e-10) << seed;
    double log_counts = 0, largest = 0;
    for (Index c = 0; c < trials.x.cols(); ++c) {
      if (trials.x.col(c).sum() > 0) log_counts += std::log(trials.x.col(c).sum());
    }
    for (const auto& renderer : trials.cells) {
      for (const auto& shape : renderer) {
        for (const ParticipantCell& cell : shape)
          largest = std::max(largest, std::abs(cell.mean_log));
      }
    }
    EXPECT_NEAR(reduced.log_determinant(), log_counts, 1e-12) << seed;
    EXPECT_EQ(reduced.scale, largest) << seed;
    // Some pair of renderers that no participant has both of.
    const MatrixXd has = (trials.z.colwise().sum().array() > 0).cast<double>();
    bool shared = true;
    const auto of = [&](std::size_t r, std::size_t p) {
      return has(0, static_cast<Index>(r * participants + p)) > 0;
    };
    for (std::size_t a = 0; a < renderers; ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        bool together = false;
        for (std::size_t p = 0; p < participants; ++p) together |= of(a, p) && of(b, p);
        shared &= together;
      }
    }
    EXPECT_EQ(reduced.shared, shared || model_cells(trials.cells).renderers.size() < renderers)
        << seed;
  }
}

}  // namespace reductions
}  // namespace
}  // namespace palpate::analysis
