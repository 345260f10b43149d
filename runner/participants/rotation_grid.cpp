#include "runner/participants/rotation_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "data/base/random.h"
#include "stimuli/grid_hull.h"

namespace palpate::runner::participants {
namespace {

constexpr int kFine = 9120;    // 11 degrees apart
constexpr int kCoarse = 4608;  // 14 degrees; for objects with few symmetries
constexpr int kFewSymmetries = 4;
constexpr int kHighestOrder = 32;  // a turn of 11 degrees, the spacing of the rotations
constexpr std::size_t kMostAxes = 1000;
constexpr std::size_t kMostSymmetries = 240;
constexpr std::size_t kSamples = 200;

// Opposite directions are one axis.
void add_axis(const Vec3& through, double least, std::vector<Vec3>& axes) {
  const double length = glm::length(through);
  if (length < least || axes.size() >= kMostAxes) return;
  const Vec3 axis = through / length;
  const bool known = std::any_of(axes.begin(), axes.end(), [&](const Vec3& other) {
    return std::abs(glm::dot(axis, other)) > 1 - 1e-7;
  });
  if (!known) axes.push_back(axis);
}

std::vector<Vec3> possible_axes(const std::vector<PlacedPart>& parts, double least) {
  std::vector<Vec3> corners;
  for (const PlacedPart& part : parts) {
    part.for_each_corner([&](const Vec3& place) { corners.push_back(place); });
  }
  std::vector<Vec3> axes;
  const stimuli::ConvexMesh hull(stimuli::grid_hull(corners, 1e-6 * least).soup);
  for (std::uint32_t f = 0; f < hull.facets().size(); ++f) {
    const stimuli::Facet& facet = hull.facets()[f];
    Vec3 middle;
    for (std::uint32_t s = facet.first_side; s < facet.first_side + facet.side_count; ++s) {
      const stimuli::Edge& edge = hull.edges()[hull.sides()[s].edge];
      middle += (edge.from + edge.to) / (2.0 * facet.side_count);
    }
    add_axis(middle, least, axes);
    add_axis(facet.normal, 0.5, axes);
  }
  for (const Vec3& vertex : hull.vertices()) add_axis(vertex, least, axes);
  for (const stimuli::Edge& edge : hull.edges()) add_axis((edge.from + edge.to) / 2.0, least, axes);
  return axes;
}

float distance_at(const DistanceField& field, const Vec3& p) {
  return field.distance(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
}

// Points near the surface, where the field is best.
std::vector<Vec3> samples(const DistanceField& field) {
  Random random(1);
  std::vector<Vec3> points;
  for (int tries = 0; tries < 100000 && points.size() < kSamples; ++tries) {
    Vec3 point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = field.low()[axis] + (field.high()[axis] - field.low()[axis]) * random.unit();
    if (std::abs(distance_at(field, point)) < field.margin() / 2) points.push_back(point);
  }
  return points;
}

}  // namespace

Quat super_fibonacci(int i, int n) {
  constexpr double kPsi = 1.533751168755204288118041;  // Alexa's constant: psi^4 = psi + 4
  const double s = i + 0.5;
  const double inner = std::sqrt(s / n);
  const double outer = std::sqrt(1 - s / n);
  const double alpha = 2 * std::numbers::pi * s / std::numbers::sqrt2;
  const double beta = 2 * std::numbers::pi * s / kPsi;
  return Quat(inner * std::sin(alpha), inner * std::cos(alpha), outer * std::sin(beta),
              outer * std::cos(beta));
}

std::vector<Quat> symmetries(const std::vector<PlacedPart>& parts, const DistanceField& field) {
  std::vector<Quat> found{Quat(1, 0, 0, 0)};
  const std::vector<Vec3> points = samples(field);
  // A sharp edge has an error of half a spacing, so single points may differ by a whole one.
  const double most = field.spacing(), usual = field.spacing() / 5;
  std::vector<float> before;
  before.reserve(points.size());
  for (const Vec3& point : points) before.push_back(distance_at(field, point));
  const auto leaves_it = [&](const Quat& turn) {
    double squares = 0;
    for (std::size_t first = 0; first < points.size(); first += lane::kWidth) {
      const std::size_t count = std::min<std::size_t>(lane::kWidth, points.size() - first);
      lane::Floats x{}, y{}, z{};
      for (std::size_t i = 0; i < count; ++i) {
        const Vec3 turned = turn * points[first + i];
        x[i] = static_cast<float>(turned.x);
        y[i] = static_cast<float>(turned.y);
        z[i] = static_cast<float>(turned.z);
      }
      const lane::Floats after = field.distances(x, y, z);
      for (std::size_t i = 0; i < count; ++i) {
        const double off = after[i] - before[first + i];
        squares += off * off;
        if (std::abs(off) > most) return false;
      }
    }
    return squares <= usual * usual * static_cast<double>(points.size());
  };
  for (const Vec3& axis : possible_axes(parts, field.spacing())) {
    if (found.size() > kMostSymmetries) break;  // nearly a sphere
    for (int order = kHighestOrder; order > 1; --order) {
      const double angle = 2 * std::numbers::pi / order;
      if (!leaves_it(glm::angleAxis(angle, axis))) continue;
      for (int k = 1; k < order; ++k) {
        const Quat turn = glm::angleAxis(k * angle, axis);
        const bool known = std::any_of(found.begin(), found.end(), [&](const Quat& other) {
          return std::abs(glm::dot(turn, other)) > 1 - 1e-6;
        });
        if (!known) found.push_back(turn);
      }
      break;
    }
  }
  return found;
}

std::vector<Mat3> distinct_rotations(const std::vector<Quat>& group) {
  const int count = static_cast<int>(group.size()) < kFewSymmetries ? kCoarse : kFine;
  std::vector<Mat3> rotations;
  for (int i = 0; i < count; ++i) {
    const Quat q = super_fibonacci(i, count);
    const bool smallest = std::all_of(group.begin(), group.end(), [&](const Quat& symmetry) {
      return std::abs((q * symmetry).w) <= std::abs(q.w) + 1e-12;
    });
    if (smallest) rotations.push_back(glm::mat3_cast(q));
  }
  if (rotations.empty()) rotations.emplace_back(1);
  return rotations;
}

}  // namespace palpate::runner::participants
