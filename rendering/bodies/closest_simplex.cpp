#include "rendering/bodies/closest_simplex.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

void keep(GapSimplex& simplex, std::initializer_list<std::size_t> which,
          std::initializer_list<double> weights) {
  const GapSimplex before = simplex;
  simplex.count = 0;
  const double* weight = weights.begin();
  for (const std::size_t i : which) {
    simplex.corners[simplex.count] = before.corners[i];
    simplex.weights[simplex.count++] = *weight++;
  }
}

void nearest_of_segment(GapSimplex& s) {
  const Vec3 &a = s.corners[0].point, &b = s.corners[1].point;
  const Vec3 ab = b - a;
  const double along = -glm::dot(a, ab), length2 = glm::dot(ab, ab);
  if (along <= 0) return keep(s, {0}, {1});
  if (along >= length2) return keep(s, {1}, {1});
  const double t = along / length2;
  s.weights = {1 - t, t, 0, 0};
}

/// Ericson, Real-Time Collision Detection 2005, 5.1.5, of the origin.
void nearest_of_triangle(GapSimplex& s) {
  const Vec3 &a = s.corners[0].point, &b = s.corners[1].point, &c = s.corners[2].point;
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = -glm::dot(ab, a), d2 = -glm::dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return keep(s, {0}, {1});
  const double d3 = -glm::dot(ab, b), d4 = -glm::dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return keep(s, {1}, {1});
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return keep(s, {0, 1}, {1 - d1 / (d1 - d3), d1 / (d1 - d3)});
  const double d5 = -glm::dot(ab, c), d6 = -glm::dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return keep(s, {2}, {1});
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return keep(s, {0, 2}, {1 - d2 / (d2 - d6), d2 / (d2 - d6)});
  const double va = d3 * d6 - d5 * d4;
  const double e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0) return keep(s, {1, 2}, {1 - e / (e + f), e / (e + f)});
  const double sum = va + vb + vc;
  s.weights = {va / sum, vb / sum, vc / sum, 0};
}

bool nearest_of_tetrahedron(GapSimplex& s) {
  constexpr std::size_t kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  GapSimplex best;
  double least = HUGE_VAL;
  for (const auto& face : kFaces) {
    const Vec3& a = s.corners[face[0]].point;
    const Vec3 normal = glm::cross(s.corners[face[1]].point - a, s.corners[face[2]].point - a);
    const double other = glm::dot(normal, s.corners[face[3]].point - a);
    const double origin = -glm::dot(normal, a);
    if (origin * other > 0) continue;  // the origin is on the inner side
    GapSimplex one;
    one.count = 3;
    for (std::size_t i = 0; i < 3; ++i) one.corners[i] = s.corners[face[i]];
    nearest_of_triangle(one);
    const Vec3 at = one.nearest();
    if (glm::dot(at, at) >= least) continue;
    least = glm::dot(at, at);
    best = one;
  }
  if (!(least < HUGE_VAL)) return false;
  s = best;
  return true;
}

}  // namespace

bool reduce_to_nearest(GapSimplex& simplex) {
  switch (simplex.count) {
    case 1:
      simplex.weights = {1, 0, 0, 0};
      return true;
    case 2:
      nearest_of_segment(simplex);
      return true;
    case 3:
      nearest_of_triangle(simplex);
      return true;
    default:
      return nearest_of_tetrahedron(simplex);
  }
}

}  // namespace palpate::rendering
