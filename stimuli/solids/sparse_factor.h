#pragma once
// A symmetric positive definite sparse matrix, factorised once (Eigen's Cholesky, approximate
// minimum degree order) for many solutions. Pure.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate::stimuli {

/// An entry of a sparse matrix; several at one place are added up.
struct MatrixEntry {
  std::uint32_t row = 0, column = 0;
  double value = 0;
};

/// Immutable.
class Factor {
 public:
  /// \throws std::invalid_argument: not positive definite
  Factor(std::size_t size, const std::vector<MatrixEntry>& entries);

  std::size_t size() const { return order_.size(); }
  std::size_t entries() const { return entries_; }  ///< of the triangular factor
  /// In place; does not allocate. \param work  twice as long as b
  void solve(std::span<double> b, std::span<double> work) const;

  static constexpr std::size_t kTogether = 16;
  /// For kTogether right-hand sides at once, interleaved row by row.
  void solve_several(std::span<double> b, std::span<double> work) const;

 private:
  template <std::size_t kSides>
  void solve_sides(double* b, double* work) const;

  /// Adjacent columns with the same rows below them (a supernode).
  struct Panel {
    std::uint32_t first_column = 0, columns = 0;
    std::uint32_t first_row = 0, rows = 0;  ///< below the triangle; in rows_
    std::size_t triangle = 0;  ///< in values_: columns^2, column by column, with 1 / diagonal
    std::size_t below = 0;     ///< in values_: rows x columns, column by column
  };

  std::vector<std::uint32_t> order_;  ///< of the matrix's row i: row order_[i] of the factor
  std::vector<Panel> panels_;
  std::vector<std::uint32_t> rows_;
  std::vector<double> values_;
  std::size_t entries_ = 0;
};

}  // namespace palpate::stimuli
