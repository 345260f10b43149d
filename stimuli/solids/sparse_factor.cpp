#include "stimuli/solids/sparse_factor.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <stdexcept>

namespace palpate::stimuli {

Factor::Factor(std::size_t size, const std::vector<MatrixEntry>& entries) {
  using Sparse = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(entries.size());
  for (const MatrixEntry& e : entries) {
    if (e.row >= e.column)
      triplets.emplace_back(static_cast<int>(e.row), static_cast<int>(e.column), e.value);
  }
  const auto n = static_cast<Eigen::Index>(size);
  Sparse matrix(n, n);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::SimplicialLLT<Sparse> cholesky(matrix);
  if (cholesky.info() != Eigen::Success)
    throw std::invalid_argument("a matrix that is not positive definite");
  const Sparse lower = cholesky.matrixL();
  order_.resize(size);
  for (std::size_t i = 0; i < size; ++i)
    order_[i] =
        static_cast<std::uint32_t>(cholesky.permutationP().indices()[static_cast<Eigen::Index>(i)]);
  const auto pattern = [&](Eigen::Index column) {
    return std::span<const int>(lower.innerIndexPtr() + lower.outerIndexPtr()[column],
                                lower.innerIndexPtr() + lower.outerIndexPtr()[column + 1]);
  };
  entries_ = static_cast<std::size_t>(lower.nonZeros());
  for (Eigen::Index first = 0; first < n;) {
    Eigen::Index next = first + 1;  // each pattern begins with the diagonal
    while (next < n && std::ranges::equal(pattern(next - 1).subspan(1), pattern(next))) ++next;
    const std::span<const int> below = pattern(next - 1).subspan(1);
    Panel panel;
    panel.first_column = static_cast<std::uint32_t>(first);
    panel.columns = static_cast<std::uint32_t>(next - first);
    panel.first_row = static_cast<std::uint32_t>(rows_.size());
    panel.rows = static_cast<std::uint32_t>(below.size());
    panel.triangle = values_.size();
    panel.below = panel.triangle + std::size_t{panel.columns} * panel.columns;
    values_.resize(panel.below + std::size_t{panel.rows} * panel.columns);
    rows_.insert(rows_.end(), below.begin(), below.end());
    for (std::size_t c = 0; c < panel.columns; ++c) {
      const auto column = first + static_cast<Eigen::Index>(c);
      const double* const value = lower.valuePtr() + lower.outerIndexPtr()[column];
      const std::size_t in_triangle = panel.columns - c;
      double* const triangle = values_.data() + panel.triangle + c * panel.columns + c;
      std::copy(value, value + in_triangle, triangle);
      triangle[0] = 1 / triangle[0];
      std::copy(value + in_triangle, value + in_triangle + panel.rows,
                values_.data() + panel.below + c * panel.rows);
    }
    panels_.push_back(panel);
    first = next;
  }
}

// Side s of row i is at [i * kSides + s].
template <std::size_t kSides>
void Factor::solve_sides(double* b, double* work) const {
  const std::size_t n = order_.size();
  double* const gathered = work + n * kSides;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t s = 0; s < kSides; ++s) work[order_[i] * kSides + s] = b[i * kSides + s];
  }
  for (const Panel& panel : panels_) {
    double* const own = work + std::size_t{panel.first_column} * kSides;
    // For a force at a few places, most columns are zero on the way to the root.
    if (std::all_of(own, own + panel.columns * kSides, [](double x) { return x == 0; })) continue;
    const std::size_t rows = panel.rows;
    std::fill(gathered, gathered + rows * kSides, 0.0);
    for (std::size_t c = 0; c < panel.columns; ++c) {
      const double* const triangle = values_.data() + panel.triangle + c * panel.columns;
      const double* const below = values_.data() + panel.below + c * rows;
      double x[kSides];
      for (std::size_t s = 0; s < kSides; ++s)
        x[s] = own[c * kSides + s] = own[c * kSides + s] * triangle[c];
      for (std::size_t k = c + 1; k < panel.columns; ++k) {
        for (std::size_t s = 0; s < kSides; ++s) own[k * kSides + s] -= triangle[k] * x[s];
      }
      for (std::size_t k = 0; k < rows; ++k) {
        for (std::size_t s = 0; s < kSides; ++s) gathered[k * kSides + s] += below[k] * x[s];
      }
    }
    const std::uint32_t* const where = rows_.data() + panel.first_row;
    for (std::size_t k = 0; k < rows; ++k) {
      for (std::size_t s = 0; s < kSides; ++s)
        work[where[k] * kSides + s] -= gathered[k * kSides + s];
    }
  }
  for (std::size_t p = panels_.size(); p-- > 0;) {
    const Panel& panel = panels_[p];
    double* const own = work + std::size_t{panel.first_column} * kSides;
    const std::size_t rows = panel.rows;
    const std::uint32_t* const where = rows_.data() + panel.first_row;
    for (std::size_t k = 0; k < rows; ++k) {
      for (std::size_t s = 0; s < kSides; ++s)
        gathered[k * kSides + s] = work[where[k] * kSides + s];
    }
    for (std::size_t c = panel.columns; c-- > 0;) {
      const double* const triangle = values_.data() + panel.triangle + c * panel.columns;
      const double* const below = values_.data() + panel.below + c * rows;
      double x[kSides];
      for (std::size_t s = 0; s < kSides; ++s) x[s] = own[c * kSides + s];
      for (std::size_t k = c + 1; k < panel.columns; ++k) {
        for (std::size_t s = 0; s < kSides; ++s) x[s] -= triangle[k] * own[k * kSides + s];
      }
      if constexpr (kSides == 1) {
        // Four sums side by side: the additions do not wait for each other.
        double sums[4] = {};
        std::size_t k = 0;
        for (; k + 4 <= rows; k += 4) {
          for (std::size_t i = 0; i < 4; ++i) sums[i] += below[k + i] * gathered[k + i];
        }
        for (; k < rows; ++k) sums[0] += below[k] * gathered[k];
        x[0] -= (sums[0] + sums[1]) + (sums[2] + sums[3]);
      } else {
        for (std::size_t k = 0; k < rows; ++k) {
          for (std::size_t s = 0; s < kSides; ++s) x[s] -= below[k] * gathered[k * kSides + s];
        }
      }
      for (std::size_t s = 0; s < kSides; ++s) own[c * kSides + s] = x[s] * triangle[c];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t s = 0; s < kSides; ++s) b[i * kSides + s] = work[order_[i] * kSides + s];
  }
}

void Factor::solve(std::span<double> b, std::span<double> work) const {
  solve_sides<1>(b.data(), work.data());
}

void Factor::solve_several(std::span<double> b, std::span<double> work) const {
  solve_sides<kTogether>(b.data(), work.data());
}

}  // namespace palpate::stimuli
