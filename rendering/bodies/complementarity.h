#pragma once
// Linear complementarity problems with bounds, solved exactly by Dantzig's method. Nothing here
// allocates once there is room.

#include <cstddef>
#include <span>
#include <vector>

namespace palpate::rendering {

/// Find x with lower <= x <= upper and w = A x - b such that, for each i, w_i = 0, or x_i is at its
/// lower bound and w_i >= 0, or at its upper and w_i <= 0. A is symmetric, positive semidefinite.
///
/// Dantzig's pivoting with friction as in Baraff 1994 (Fast contact force computation): rows enter
/// one after another, and each step continues until some row changes from bound to free or back. A
/// row with a `leader` is friction: its bounds are +-coefficient times x of its leader, taken when
/// all rows without leaders are solved. Departs: the Cholesky factor of the free rows raises the
/// diagonal by 1e-14 of itself, so that redundant contacts do no harm.
class ComplementarityProblem {
 public:
  static constexpr std::size_t kMostRows = 192;

  ComplementarityProblem();

  /// Allocates working memory, for a copy.
  void make_room();
  void clear() { count_ = 0; }
  std::size_t size() const { return count_; }
  bool full() const { return count_ == kMostRows; }
  /// \param leader  index of an earlier row; the bounds are multiples of its x; -1: none
  /// \param bound   without leader: upper bound (the lower is 0), HUGE_VAL: none; else the
  /// coefficient
  void add_row(double b, double bound, int leader = -1);
  /// Fill in when all rows are added.
  double& a(std::size_t row, std::size_t column) { return matrix_[row * count_ + column]; }
  double a(std::size_t row, std::size_t column) const { return matrix_[row * count_ + column]; }

  /// Scales the coefficients of all rows with a leader. Keeps the matrix.
  void scale_friction(double factor);

  /// False: the limit of pivots was reached; x is within its bounds and approximated by sweeps.
  bool solve();
  /// Solves again with the bounds that follow from the leaders' x after solve() or the last
  /// refine().
  /// \return the largest change of a leader's x
  double refine();
  std::span<const double> x() const { return {x_.data(), count_}; }
  /// Largest violation of the conditions above, in units of w.
  double residual() const;

 private:
  void set_bounds(std::size_t row);
  bool drive(std::size_t row, int& pivots_left);
  void free_row(std::size_t row);
  void bind_row(std::size_t position);
  void refactor(std::size_t from);
  void solve_free(std::size_t column, double* out) const;
  void find_rates(std::size_t row);
  double slack(std::size_t row) const;
  void sweep();
  bool drive_all(bool bounds_known);

  std::size_t count_ = 0;
  std::vector<double> matrix_, factor_;  ///< factor_ by position in free_
  std::vector<std::size_t> first_;       ///< of each row of factor_: its first non-zero entry
  std::vector<double> b_, bound_, x_, w_, lower_, upper_, change_, rate_, before_;
  std::vector<int> leader_;
  std::vector<std::size_t> free_;
  std::vector<std::size_t> done_;  ///< rows at a bound that have entered
};

}  // namespace palpate::rendering
