#include "stimuli/layers/plane_corner.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

namespace palpate::stimuli {

void PlaneCorner::add(const Vec3& point, const Vec3& normal) {
  products_ += glm::outerProduct(normal, normal);
  offsets_ += glm::dot(normal, point) * normal;
  points_ += point;
  count_ += 1;
}

Vec3 PlaneCorner::corner(int rank) const {
  // Jacobi's rotations (Golub & Van Loan 2013, 8.5); a few sweeps suffice for 3 x 3.
  Mat3 a = products_, axes(1);
  for (int sweep = 0; sweep < 8; ++sweep) {
    for (const auto& [p, q] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
      if (std::abs(a[p][q]) < 1e-300) continue;
      const double half = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const double t = (half >= 0 ? 1 : -1) / (std::abs(half) + std::sqrt(half * half + 1));
      const double c = 1 / std::sqrt(t * t + 1), s = t * c;
      Mat3 turn(1);
      turn[p][p] = turn[q][q] = c;
      turn[q][p] = s;
      turn[p][q] = -s;
      a = glm::transpose(turn) * a * turn;
      axes = axes * turn;
    }
  }
  std::array<int, 3> order{0, 1, 2};
  for (const auto& [i, k] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
    if (a[order[i]][order[i]] < a[order[k]][order[k]]) std::swap(order[i], order[k]);
  }
  const Vec3 mean = points_ / count_;
  const Vec3 rest = offsets_ - products_ * mean;
  // Normals that differ by rounding only do not decide.
  constexpr double kLeast = 1e-4;  // of the largest: planes at 1 degree
  Vec3 out = mean;
  for (int i = 0; i < rank; ++i) {
    const double value = a[order[i]][order[i]];
    if (i > 0 && value < kLeast * a[order[0]][order[0]]) break;
    out += glm::dot(axes[order[i]], rest) / value * axes[order[i]];
  }
  return out;
}

}  // namespace palpate::stimuli
