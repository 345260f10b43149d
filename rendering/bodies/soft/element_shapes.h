#pragma once
// Shape functions of the elements, and where they are integrated. The room's own.

#include <array>
#include <cmath>

namespace palpate::rendering::elements {

/// Derivatives of the shape functions by the element's own coordinates, at a point of integration.
template <int kNodes>
struct Derivatives {
  double value[kNodes];
  double slope[kNodes][3];
  double weight;
};

/// Trilinear hexahedron, 2 x 2 x 2 points of Gauss.
inline Derivatives<8> at_point(std::integral_constant<int, 8> /*nodes*/, int point) {
  constexpr int kSigns[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const double g = 1 / std::sqrt(3.0);
  double at[3];
  for (int i = 0; i < 3; ++i) at[i] = g * kSigns[point][i];
  Derivatives<8> d{};
  d.weight = 1;
  for (int a = 0; a < 8; ++a) {
    double f[3];
    for (int i = 0; i < 3; ++i) f[i] = 0.5 * (1 + kSigns[a][i] * at[i]);
    d.value[a] = f[0] * f[1] * f[2];
    for (int i = 0; i < 3; ++i)
      d.slope[a][i] = 0.5 * kSigns[a][i] * f[(i + 1) % 3] * f[(i + 2) % 3];
  }
  return d;
}

/// Quadratic tetrahedron, four points, exact to second degree (Keast 1986).
inline Derivatives<10> at_point(std::integral_constant<int, 10> /*nodes*/, int point) {
  constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  const double small = (5 - std::sqrt(5.0)) / 20;
  double l[4];
  for (int i = 0; i < 4; ++i) l[i] = i == point ? 1 - 3 * small : small;
  constexpr double kSlopes[4][3] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Derivatives<10> d{};
  d.weight = 1.0 / 24;
  for (int a = 0; a < 4; ++a) {
    d.value[a] = l[a] * (2 * l[a] - 1);
    for (int i = 0; i < 3; ++i) d.slope[a][i] = (4 * l[a] - 1) * kSlopes[a][i];
  }
  for (int e = 0; e < 6; ++e) {
    const int a = kEdges[e][0], b = kEdges[e][1];
    d.value[4 + e] = 4 * l[a] * l[b];
    for (int i = 0; i < 3; ++i)
      d.slope[4 + e][i] = 4 * (l[a] * kSlopes[b][i] + l[b] * kSlopes[a][i]);
  }
  return d;
}

}  // namespace palpate::rendering::elements
