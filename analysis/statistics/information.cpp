#include "analysis/statistics/information.h"

#include <algorithm>
#include <cmath>

namespace palpate::analysis {
namespace {

using CountTable = std::vector<std::vector<std::size_t>>;

struct Margins {
  std::vector<double> rows, columns;
  double total = 0;
  std::size_t cells = 0;  // with trials
};

Margins margins_of(const CountTable& counts) {
  Margins sums;
  for (const auto& row : counts) {
    double trials = 0;
    if (row.size() > sums.columns.size()) sums.columns.resize(row.size(), 0);
    for (std::size_t answer = 0; answer < row.size(); ++answer) {
      const auto n = static_cast<double>(row[answer]);
      trials += n;
      sums.columns[answer] += n;
      sums.cells += row[answer] > 0 ? 1 : 0;
    }
    sums.rows.push_back(trials);
    sums.total += trials;
  }
  return sums;
}

/// n log2 n
double nlogn(double n) { return n > 0 ? n * std::log2(n) : 0; }

double sum_nlogn(const std::vector<double>& counts) {
  double sum = 0;
  for (const double n : counts) sum += nlogn(n);
  return sum;
}

/// T of N trials: (sum n log n - sum rows - sum columns + N log N) / N.
double transfer(double cells, double rows, double columns, double total) {
  return (cells - rows - columns + nlogn(total)) / total;
}

std::size_t filled(const std::vector<double>& counts) {
  std::size_t number = 0;
  for (const double n : counts) number += n > 0 ? 1 : 0;
  return number;
}

/// Jackknife: every trial left out once; trials of a cell are alike.
double jackknife_error(const CountTable& counts, const Margins& sums, double cells, double rows,
                       double columns) {
  double mean_left = 0, squares = 0;
  for (std::size_t s = 0; s < counts.size(); ++s) {
    for (std::size_t a = 0; a < counts[s].size(); ++a) {
      if (counts[s][a] == 0) continue;
      const auto n = static_cast<double>(counts[s][a]);
      const double left = transfer(
          cells - nlogn(n) + nlogn(n - 1), rows - nlogn(sums.rows[s]) + nlogn(sums.rows[s] - 1),
          columns - nlogn(sums.columns[a]) + nlogn(sums.columns[a] - 1), sums.total - 1);
      mean_left += n * left / sums.total;
      squares += n * left * left;
    }
  }
  const double deviation = std::max(0.0, squares - sums.total * mean_left * mean_left);
  return std::sqrt((sums.total - 1) / sums.total * deviation);
}

}  // namespace

InformationTransfer information_transfer(const CountTable& counts) {
  InformationTransfer result;
  const Margins sums = margins_of(counts);
  result.trials = static_cast<std::size_t>(sums.total);
  if (sums.total == 0) {
    result.undefined = "no answers";
    return result;
  }
  double cells = 0;
  for (const auto& row : counts) {
    for (const std::size_t n : row) cells += nlogn(static_cast<double>(n));
  }
  const double rows = sum_nlogn(sums.rows), columns = sum_nlogn(sums.columns);
  result.stimulus_entropy = (nlogn(sums.total) - rows) / sums.total;
  result.plain = std::max(0.0, transfer(cells, rows, columns, sums.total));
  const double extra = static_cast<double>(sums.cells) - static_cast<double>(filled(sums.rows)) -
                       static_cast<double>(filled(sums.columns)) + 1;
  // With few errors few cells beyond the diagonal are filled and `extra` is below 0, but counts of
  // a sample never transmit too little on average.
  result.corrected = *result.plain - std::max(0.0, extra) / (2 * sums.total * std::log(2.0));
  result.categories = std::exp2(std::max(0.0, *result.corrected));
  if (sums.total > 1) result.se = jackknife_error(counts, sums, cells, rows, columns);
  return result;
}

}  // namespace palpate::analysis
