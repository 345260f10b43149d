#include "analysis/statistics/simplex.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace palpate::analysis {
namespace {

using Function = std::function<double(const std::vector<double>&)>;

constexpr int kMostMoves = 2000;
constexpr int kMostRestarts = 20;

/// centre + t (centre - from)
std::vector<double> along(const std::vector<double>& centre, const std::vector<double>& from,
                          double t) {
  std::vector<double> place(centre.size());
  for (std::size_t i = 0; i < place.size(); ++i) place[i] = centre[i] + t * (centre[i] - from[i]);
  return place;
}

std::vector<double> centre_of_all_but_last(const std::vector<SimplexMinimum>& corners) {
  std::vector<double> centre(corners.size() - 1, 0);
  for (std::size_t c = 0; c + 1 < corners.size(); ++c) {
    for (std::size_t i = 0; i < centre.size(); ++i)
      centre[i] += corners[c].place[i] / static_cast<double>(centre.size());
  }
  return centre;
}

void sort_corners(std::vector<SimplexMinimum>& corners) {
  std::sort(corners.begin(), corners.end(),
            [](const auto& a, const auto& b) { return a.value < b.value; });
}

SimplexMinimum descend(const Function& function, const std::vector<double>& start,
                       const std::vector<double>& steps, double tolerance) {
  std::vector<SimplexMinimum> corners{{start, function(start)}};
  for (std::size_t i = 0; i < start.size(); ++i) {
    std::vector<double> place = start;
    place[i] += steps[i];
    corners.push_back({place, function(place)});
  }
  const auto at = [&](std::vector<double> place) {
    const double value = function(place);
    return SimplexMinimum{std::move(place), value};
  };
  for (int move = 0; move < kMostMoves; ++move) {
    sort_corners(corners);
    SimplexMinimum& worst = corners.back();
    if (worst.value - corners.front().value <= tolerance) break;
    const std::vector<double> centre = centre_of_all_but_last(corners);
    SimplexMinimum reflected = at(along(centre, worst.place, 1));
    if (reflected.value < corners.front().value) {
      SimplexMinimum expanded = at(along(centre, worst.place, 2));
      worst = expanded.value < reflected.value ? std::move(expanded) : std::move(reflected);
    } else if (reflected.value < corners[corners.size() - 2].value) {
      worst = std::move(reflected);
    } else {
      const bool outside = reflected.value < worst.value;
      SimplexMinimum contracted = at(along(centre, worst.place, outside ? 0.5 : -0.5));
      if (contracted.value < std::min(reflected.value, worst.value)) {
        worst = std::move(contracted);
      } else {
        for (std::size_t c = 1; c < corners.size(); ++c)
          corners[c] = at(along(corners.front().place, corners[c].place, -0.5));
      }
    }
  }
  sort_corners(corners);
  return corners.front();
}

}  // namespace

SimplexMinimum minimize(const Function& function, const std::vector<double>& start,
                        const std::vector<double>& steps, double tolerance) {
  if (start.empty()) return {{}, function({})};
  SimplexMinimum best = descend(function, start, steps, tolerance);
  for (int i = 0; i < kMostRestarts; ++i) {
    std::vector<double> smaller = steps;
    for (double& step : smaller) step *= i % 2 == 0 ? -0.1 : 0.1;
    SimplexMinimum again = descend(function, best.place, smaller, tolerance);
    const double gain = best.value - again.value;
    if (gain > 0) best = std::move(again);
    if (!(gain > 100 * tolerance)) break;
  }
  return best;
}

}  // namespace palpate::analysis
