#include "runner/evidence/verification/nearest_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

// Planes whose normals span less than this (squared sine, or the squared volume of three) have no
// intersection that is stable under rounding.
constexpr double kDependent = 1e-13;

/// The multipliers that move `from` onto all chosen planes.
bool on_planes(const Vec3& from, std::span<const HalfSpace> planes,
               std::span<const std::size_t> chosen, std::array<double, 3>& multipliers) {
  // A plane that is not chosen is replaced by an equation of its own: multiplier = 0.
  Mat3 products(1);
  Vec3 gaps(0);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const HalfSpace& a = planes[chosen[i]];
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      products[static_cast<int>(k)][static_cast<int>(i)] =
          glm::dot(a.normal, planes[chosen[k]].normal);
    }
    gaps[static_cast<int>(i)] = a.offset - glm::dot(a.normal, from);
  }
  if (chosen.size() > 1 && glm::determinant(products) < kDependent) return false;
  const Vec3 solved = glm::inverse(products) * gaps;
  for (std::size_t i = 0; i < chosen.size(); ++i) multipliers[i] = solved[static_cast<int>(i)];
  return true;
}

/// A Newton step of the same system removes rounding errors.
Vec3 displaced(const Vec3& from, std::span<const HalfSpace> planes,
               std::span<const std::size_t> chosen, std::array<double, 3>& multipliers) {
  Vec3 at = from;
  for (std::size_t i = 0; i < chosen.size(); ++i) at += multipliers[i] * planes[chosen[i]].normal;
  std::array<double, 3> more{};
  on_planes(at, planes, chosen, more);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    at += more[i] * planes[chosen[i]].normal;
    multipliers[i] += more[i];
  }
  return at;
}

bool above_all(const Vec3& point, std::span<const HalfSpace> planes, double tolerance) {
  return std::all_of(planes.begin(), planes.end(), [&](const HalfSpace& plane) {
    return glm::dot(plane.normal, point) - plane.offset >= -tolerance;
  });
}

/// Normals that span a line, a plane or the space. A vector's multiple of each normal is its
/// product with `up`.
struct Generators {
  std::array<Vec3, 3> normals, up;
  std::size_t count = 0;

  /// m, the residual of the vector after its non-negative multiples; infinity if a multiple is
  /// negative, or so large that the residual is rounding.
  double rest(const Vec3& vector, double most_multiple) const {
    Vec3 left = vector;
    std::array<double, 3> multiples{};
    for (int step = 0; step < 2; ++step) {  // the second removes the rounding of the first
      const Vec3 before = left;
      for (std::size_t i = 0; i < count; ++i) {
        const double more = glm::dot(up[i], before);
        multiples[i] += more;
        left -= more * normals[i];
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!(multiples[i] >= 0 && multiples[i] <= most_multiple * glm::length(vector)))
        return std::numeric_limits<double>::infinity();
    }
    return glm::length(left);
  }
};

}  // namespace

bool separated_by_facet_plane(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& before,
                              const rendering::LineProbe& after) {
  return std::any_of(mesh.facets().begin(), mesh.facets().end(), [&](const stimuli::Facet& facet) {
    return std::min({glm::dot(facet.normal, before.tip), glm::dot(facet.normal, before.tail),
                     glm::dot(facet.normal, after.tip), glm::dot(facet.normal, after.tail)}) >
           facet.offset;
  });
}

std::optional<ReferenceDepth> measure_feature(const stimuli::ConvexMesh& mesh, bool is_edge,
                                              std::uint32_t i, const rendering::LineProbe& probe) {
  if (!is_edge) {
    const stimuli::Facet& facet = mesh.facets()[i];
    return ReferenceDepth{facet.offset - std::min(glm::dot(facet.normal, probe.tip),
                                                  glm::dot(facet.normal, probe.tail)),
                          facet.normal};
  }
  const stimuli::Edge& edge = mesh.edges()[i];
  const Vec3 &left = mesh.facets()[edge.left].normal, &right = mesh.facets()[edge.right].normal;
  const Vec3 d = probe.tail - probe.tip;
  const double left_slope = glm::dot(left, d), right_slope = glm::dot(right, d);
  if ((left_slope >= 0) == (right_slope >= 0)) return std::nullopt;
  const Vec3 normal = glm::normalize(std::abs(right_slope) * left + std::abs(left_slope) * right);
  return ReferenceDepth{glm::dot(normal, edge.from - probe.tip), normal};
}

std::optional<EntryFeature> entry_feature(const stimuli::ConvexMesh& mesh,
                                          const rendering::LineProbe& probe) {
  std::optional<EntryFeature> best;
  double least = std::numeric_limits<double>::infinity(), second = least;
  const auto consider = [&](bool is_edge, std::uint32_t i) {
    const auto at = measure_feature(mesh, is_edge, i, probe);
    if (!at) return;
    second = std::min(second, std::max(at->depth, least));
    if (at->depth < least) {
      second = least;
      least = at->depth;
      best = EntryFeature{is_edge, i};
    }
  };
  for (std::uint32_t i = 0; i < mesh.facets().size(); ++i) consider(false, i);
  for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) consider(true, i);
  // Where another depth is this close, rounding decides.
  if (second - least < kNeighbouringDepths * mesh.size()) return std::nullopt;
  return best;
}

std::optional<NearestPoint> nearest_point(const Vec3& from, std::span<const HalfSpace> planes,
                                          double tolerance) {
  std::optional<NearestPoint> nearest;
  double least = 0;
  const auto try_on = [&](std::span<const std::size_t> chosen) {
    std::array<double, 3> multipliers{};
    if (!on_planes(from, planes, chosen, multipliers)) return;
    const Vec3 point = displaced(from, planes, chosen, multipliers);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (multipliers[i] < 0) return;
    }
    if (!above_all(point, planes, tolerance)) return;
    const double distance = glm::length(point - from);
    if (nearest && distance >= least) return;
    least = distance;
    nearest = NearestPoint{point, std::vector<double>(planes.size(), 0.0)};
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      nearest->multipliers[chosen[i]] = multipliers[i];
    }
  };
  // Only one point satisfies the Karush-Kuhn-Tucker conditions. Where planes coincide within the
  // tolerance, several sets of them give it; any will do.
  try_on({});
  const std::size_t n = planes.size();
  for (std::size_t a = 0; a < n; ++a) try_on(std::array{a});
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) try_on(std::array{a, b});
  }
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      for (std::size_t c = b + 1; c < n; ++c) try_on(std::array{a, b, c});
    }
  }
  return nearest;
}

double distance_to_cone(const Vec3& vector, std::span<const Vec3> normals, double most_multiple) {
  double least = glm::length(vector);
  const auto try_on = [&](const Generators& some) {
    least = std::min(least, some.rest(vector, most_multiple));
  };
  const std::size_t n = normals.size();
  for (std::size_t a = 0; a < n; ++a) {
    const Vec3& p = normals[a];
    try_on({{p}, {p}, 1});
    for (std::size_t b = a + 1; b < n; ++b) {
      const Vec3& q = normals[b];
      const Vec3 pq = glm::cross(p, q);
      const double sine2 = glm::dot(pq, pq);
      if (sine2 > 0) try_on({{p, q}, {glm::cross(q, pq) / sine2, glm::cross(pq, p) / sine2}, 2});
      for (std::size_t c = b + 1; c < n; ++c) {
        const Vec3& r = normals[c];
        const double volume = glm::dot(pq, r);
        if (volume == 0) continue;
        try_on({{p, q, r}, {glm::cross(q, r) / volume, glm::cross(r, p) / volume, pq / volume}, 3});
      }
    }
  }
  return least;
}

}  // namespace palpate::runner::evidence
