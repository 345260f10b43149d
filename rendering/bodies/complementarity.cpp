#include "rendering/bodies/complementarity.h"

#include <algorithm>
#include <cmath>

namespace palpate::rendering {
namespace {

/// Four sums at a time, so that additions do not wait for each other.
double dot_product(const double* a, const double* b, std::size_t count) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    s0 += a[k] * b[k];
    s1 += a[k + 1] * b[k + 1];
    s2 += a[k + 2] * b[k + 2];
    s3 += a[k + 3] * b[k + 3];
  }
  for (; k < count; ++k) s0 += a[k] * b[k];
  return (s0 + s1) + (s2 + s3);
}

}  // namespace

ComplementarityProblem::ComplementarityProblem()
    : matrix_(kMostRows * kMostRows),
      factor_(kMostRows * kMostRows),
      first_(kMostRows),
      b_(kMostRows),
      bound_(kMostRows),
      x_(kMostRows),
      w_(kMostRows),
      lower_(kMostRows),
      upper_(kMostRows),
      change_(kMostRows),
      rate_(kMostRows),
      before_(kMostRows),
      leader_(kMostRows) {
  make_room();
}

void ComplementarityProblem::make_room() {
  free_.reserve(kMostRows);
  done_.reserve(kMostRows);
}

void ComplementarityProblem::add_row(double b, double bound, int leader) {
  b_[count_] = b;
  bound_[count_] = bound;
  leader_[count_++] = leader;
}

void ComplementarityProblem::scale_friction(double factor) {
  for (std::size_t i = 0; i < count_; ++i) {
    if (leader_[i] >= 0) bound_[i] *= factor;
  }
}

double ComplementarityProblem::slack(std::size_t row) const {
  return dot_product(&matrix_[row * count_], x_.data(), count_) - b_[row];
}

void ComplementarityProblem::set_bounds(std::size_t row) {
  const int leader = leader_[row];
  upper_[row] = leader < 0 ? bound_[row] : bound_[row] * x_[static_cast<std::size_t>(leader)];
  lower_[row] = leader < 0 ? 0 : -upper_[row];
}

/// Recomputes the rows of the factor from a position on.
void ComplementarityProblem::refactor(std::size_t from) {
  constexpr double kRaise = 1e-14;
  for (std::size_t i = from; i < free_.size(); ++i) {
    double* const row = &factor_[i * count_];
    std::size_t first = 0;
    while (first < i && a(free_[i], free_[first]) == 0) ++first;
    first_[i] = first;
    for (std::size_t j = first; j < i; ++j) {
      const double* const other = &factor_[j * count_];
      const std::size_t begin = std::max(first, first_[j]);
      const double known = begin < j ? dot_product(row + begin, other + begin, j - begin) : 0;
      row[j] = (a(free_[i], free_[j]) - known) / other[j];
    }
    const double diagonal = a(free_[i], free_[i]);
    const double rest = diagonal - dot_product(row + first, row + first, i - first);
    row[i] = std::sqrt(std::max(rest, 0.0) + kRaise * diagonal);
  }
}

void ComplementarityProblem::free_row(std::size_t row) {
  free_.push_back(row);
  refactor(free_.size() - 1);
}

void ComplementarityProblem::bind_row(std::size_t position) {
  done_.push_back(free_[position]);
  free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(position));
  refactor(position);
}

/// The response of the free rows to a unit of x of one row: A_ff out = -A_f,column.
void ComplementarityProblem::solve_free(std::size_t column, double* out) const {
  const std::size_t n = free_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double* const row = &factor_[i * count_];
    const double known = dot_product(row + first_[i], out + first_[i], i - first_[i]);
    out[i] = (-a(column, free_[i]) - known) / row[i];
  }
  for (std::size_t i = n; i-- > 0;) {
    const double* const row = &factor_[i * count_];
    out[i] /= row[i];
    for (std::size_t k = first_[i]; k < i; ++k) out[k] -= row[k] * out[i];
  }
}

/// Rates of every row's slack by a unit of x of one row and the free rows' response.
void ComplementarityProblem::find_rates(std::size_t row) {
  std::copy_n(&matrix_[row * count_], count_, rate_.begin());
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const double change = change_[k];
    const double* const column = &matrix_[free_[k] * count_];
    if (change == 0) continue;
    for (std::size_t i = 0; i < count_; ++i) rate_[i] += change * column[i];
  }
}

/// Lets one row enter. False: no pivots are left.
bool ComplementarityProblem::drive(std::size_t row, int& pivots_left) {
  constexpr double kFelt = 1e-9;  // m/s, and of b
  x_[row] = 0;
  w_[row] = slack(row);
  const double scale = std::abs(b_[row]) + std::abs(a(row, row));
  while (true) {
    const bool at_lower = x_[row] <= lower_[row], at_upper = x_[row] >= upper_[row];
    const bool holds = std::abs(w_[row]) <= 1e-15 * scale || (w_[row] > 0 && at_lower) ||
                       (w_[row] < 0 && at_upper);
    if (holds) {
      // Between its bounds it must be free, or later rows would move its slack.
      if (!at_lower && !at_upper)
        free_row(row);
      else
        done_.push_back(row);
      return true;
    }
    if (--pivots_left < 0) return false;
    const double direction = w_[row] < 0 ? 1 : -1;
    solve_free(row, change_.data());
    find_rates(row);
    const double own_rate = direction * rate_[row];
    // A row that depends on the free ones does not respond until one of them has gone to its bound.
    // Violations within rounding, and friction, are left as they are.
    const bool answers = std::abs(own_rate) > 1e-12 * std::abs(a(row, row));
    const bool violated = std::abs(w_[row]) > kFelt * (1 + std::abs(b_[row]));
    double step = answers ? -w_[row] / own_rate : HUGE_VAL;
    enum class Stop { zero, bound, bind, release } stop = answers ? Stop::zero : Stop::bound;
    std::size_t at = 0;
    if (!answers && !(violated && leader_[row] < 0)) return done_.push_back(row), true;
    const double room = direction > 0 ? upper_[row] - x_[row] : x_[row] - lower_[row];
    if (room < step) {
      step = room;
      stop = Stop::bound;
    }
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const double change = direction * change_[k];
      const std::size_t i = free_[k];
      if (change == 0) continue;
      const double to_bound = (change > 0 ? upper_[i] - x_[i] : lower_[i] - x_[i]) / change;
      if (to_bound < step) {
        step = std::max(0.0, to_bound);
        stop = Stop::bind;
        at = k;
      }
    }
    for (std::size_t k = 0; k < done_.size(); ++k) {
      const std::size_t i = done_[k];
      const double rate = direction * rate_[i];
      // At the lower bound slack must not fall below 0, at the upper not rise above 0.
      const bool low = x_[i] <= lower_[i], high = x_[i] >= upper_[i];
      if (low && high) continue;
      if (low ? rate >= 0 : rate <= 0) continue;
      if (std::abs(rate) <= 1e-12 * std::abs(a(i, i))) continue;
      const double to_zero = std::max(0.0, -w_[i] / rate);
      if (to_zero < step) {
        step = to_zero;
        stop = Stop::release;
        at = k;
      }
    }
    if (!(step < HUGE_VAL)) return done_.push_back(row), true;  // no impulse can satisfy it
    x_[row] += direction * step;
    w_[row] += own_rate * step;
    for (std::size_t k = 0; k < free_.size(); ++k) x_[free_[k]] += direction * step * change_[k];
    for (std::size_t k = 0; k < done_.size(); ++k)
      w_[done_[k]] += direction * rate_[done_[k]] * step;
    switch (stop) {
      case Stop::zero:
        w_[row] = 0;
        free_row(row);
        return true;
      case Stop::bound:
        x_[row] = direction > 0 ? upper_[row] : lower_[row];
        done_.push_back(row);
        return true;
      case Stop::bind: {
        const std::size_t i = free_[at];
        x_[i] = direction * change_[at] > 0 ? upper_[i] : lower_[i];
        w_[i] = 0;
        bind_row(at);
        break;
      }
      case Stop::release: {
        const std::size_t i = done_[at];
        done_.erase(done_.begin() + static_cast<std::ptrdiff_t>(at));
        w_[i] = 0;
        free_row(i);
        break;
      }
    }
  }
}

/// Projected Gauss-Seidel, used if pivoting reached its limit.
void ComplementarityProblem::sweep() {
  constexpr int kSweeps = 200;
  for (int round = 0; round < kSweeps; ++round) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (!(a(i, i) > 0)) continue;
      set_bounds(i);
      x_[i] = std::clamp(x_[i] - slack(i) / a(i, i), lower_[i], upper_[i]);
    }
  }
}

bool ComplementarityProblem::drive_all(bool bounds_known) {
  free_.clear();
  done_.clear();
  std::fill_n(x_.begin(), count_, 0.0);
  int pivots_left = static_cast<int>(20 * count_) + 50;
  for (const bool friction : {false, true}) {
    for (std::size_t i = 0; i < count_; ++i) {
      if ((leader_[i] >= 0) == friction && !(friction && bounds_known)) set_bounds(i);
    }
    for (std::size_t i = 0; i < count_; ++i) {
      if ((leader_[i] >= 0) != friction || drive(i, pivots_left)) continue;
      sweep();
      return false;
    }
  }
  return true;
}

bool ComplementarityProblem::solve() { return drive_all(false); }

double ComplementarityProblem::refine() {
  std::copy_n(x_.begin(), count_, before_.begin());
  for (std::size_t i = 0; i < count_; ++i) {
    if (leader_[i] >= 0) set_bounds(i);
  }
  drive_all(true);
  double change = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (leader_[i] < 0) continue;
    const auto leader = static_cast<std::size_t>(leader_[i]);
    change = std::max(change, std::abs(x_[leader] - before_[leader]));
  }
  return change;
}

double ComplementarityProblem::residual() const {
  double worst = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const double w = slack(i);
    if (x_[i] <= lower_[i] && x_[i] >= upper_[i]) continue;
    if (x_[i] <= lower_[i])
      worst = std::max(worst, -w);
    else if (x_[i] >= upper_[i])
      worst = std::max(worst, w);
    else
      worst = std::max(worst, std::abs(w));
  }
  return worst;
}

}  // namespace palpate::rendering
