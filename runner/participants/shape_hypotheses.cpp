#include "runner/participants/shape_hypotheses.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "data/base/random.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/grid_hull.h"
#include "stimuli/inset.h"
#include "stimuli/layers/layer_surface.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"

namespace palpate::runner::participants {
namespace {

/// Depth of the felt surface, m; none: the object has no stiffness anywhere.
std::optional<double> felt_depth(const stimuli::Material& material) {
  if (material.stiffness > 0) return 0;
  for (const stimuli::Layer& layer : material.layers) {
    if (layer.stiffness > 0) return layer.depth;
  }
  return std::nullopt;
}

void add(const stimuli::ObjectSpec& spec, const Pose& parent, std::vector<PlacedPart>& out) {
  const Pose pose = stimuli::compose(parent, spec.pose);
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) add(part, pose, out);
    return;
  }
  const std::optional<double> depth = felt_depth(spec.material);
  if (!depth) return;
  if (spec.shape == stimuli::ShapeKind::mesh) {
    const stimuli::PolygonSoup soup = stimuli::polygons_of(spec);
    if (!stimuli::convex_as_it_is(soup)) {
      stimuli::ClosedSurface surface = stimuli::closed_surface(soup).surface;
      if (*depth > 0) {
        const std::vector<stimuli::PlacedShell> shells = {{&surface, Pose{}}};
        surface = stimuli::layer_surface(stimuli::SolidDepth(shells), *depth).surface;
      }
      out.push_back(
          {nullptr, pose, std::make_shared<const stimuli::ClosedSurface>(std::move(surface))});
      return;
    }
  }
  std::vector<std::shared_ptr<const stimuli::ConvexMesh>> meshes;
  for (stimuli::ConvexMesh& part : stimuli::convex_parts(spec))
    meshes.push_back(std::make_shared<const stimuli::ConvexMesh>(std::move(part)));
  if (*depth > 0) meshes = stimuli::inset_union(meshes, *depth);
  for (auto& mesh : meshes) out.push_back({std::move(mesh), pose});
}

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

constexpr int kConeAxes = 380;
constexpr int kCylinderAxes = 150;
constexpr int kAllRotations = 9120;  // 380 times the 24 symmetries of the cube

/// A frame whose z axis is `axis`; the other two are arbitrary.
Mat3 frame_around(const Vec3& axis) {
  const Vec3 helper = std::abs(axis.z) < 0.9 ? Vec3(0, 0, 1) : Vec3(1, 0, 0);
  const Vec3 x = glm::normalize(glm::cross(helper, axis));
  return {x, glm::cross(axis, x), axis};
}

/// Fibonacci spiral from z = 1 to z = lowest: equal areas along a golden-angle spiral.
std::vector<Mat3> spiral_axes(int count, double lowest) {
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Mat3> frames;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (1 - lowest) * (i + 0.5) / count;
    const double radius = std::sqrt(1 - z * z);
    frames.push_back(frame_around(
        {radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z}));
  }
  return frames;
}

/// Whether this is the smallest of the 24 equivalent rotations of a cube: the cubic fundamental
/// zone, in Rodrigues vectors a cube with its corners cut off (Frank 1988).
bool in_cubic_zone(const Quat& q) {
  const double w = std::abs(q.w);
  const double x = std::abs(q.x);
  const double y = std::abs(q.y);
  const double z = std::abs(q.z);
  const double face = (std::numbers::sqrt2 - 1) * w;
  return x <= face && y <= face && z <= face && x + y + z <= w;
}

/// Point i of n of a super-Fibonacci spiral, evenly spread over all rotations (Alexa 2022,
/// "Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of SO(3)", algorithm 1).
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

std::vector<Mat3> cube_rotations() {
  std::vector<Mat3> rotations;
  for (int i = 0; i < kAllRotations; ++i) {
    const Quat q = super_fibonacci(i, kAllRotations);
    if (in_cubic_zone(q)) rotations.push_back(glm::mat3_cast(q));
  }
  return rotations;
}

std::vector<Mat3> formula_rotations(stimuli::ShapeKind kind) {
  switch (kind) {
    case stimuli::ShapeKind::cone:
      return spiral_axes(kConeAxes, -1);
    case stimuli::ShapeKind::cylinder:
      return spiral_axes(kCylinderAxes, 0);
    case stimuli::ShapeKind::cube:
      return cube_rotations();
    case stimuli::ShapeKind::sphere:
      return {Mat3(1)};
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("no formula for this shape");
}

/// Whether it is a shape with a formula, centred and felt at its surface.
bool has_formula(const stimuli::ObjectSpec& stimulus) {
  return stimuli::traits_of(stimulus.shape).formula && stimulus.pose.position == Vec3(0) &&
         stimulus.pose.orientation == Quat(1, 0, 0, 0) && stimulus.material.stiffness > 0;
}

bool usable(double length) { return std::isfinite(length) && length > 0; }

}  // namespace

bool can_be_felt(const stimuli::ObjectSpec& stimulus) {
  if (stimulus.shape != stimuli::ShapeKind::compound)
    return felt_depth(stimulus.material).has_value();
  return std::any_of(stimulus.parts.begin(), stimulus.parts.end(), can_be_felt);
}

std::vector<PlacedPart> felt_parts(const stimuli::ObjectSpec& stimulus) {
  std::vector<PlacedPart> parts;
  add(stimulus, Pose{}, parts);
  return parts;
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

std::string ShapeHypotheses::fault_of(const stimuli::ObjectSpec& stimulus) {
  const stimuli::ShapeTraits needs = stimuli::traits_of(stimulus.shape);
  if (needs.radius && !usable(stimulus.radius)) return "its radius is not positive";
  if (needs.height && !usable(stimulus.height)) return "its height is not positive";
  if (needs.edge && !usable(stimulus.edge)) return "its edge is not positive";
  if (!can_be_felt(stimulus)) return "it has no stiffness anywhere, so it cannot be felt";
  return "";
}

ShapeHypotheses::ShapeHypotheses(const std::vector<stimuli::ObjectSpec>& stimuli) {
  std::string faults;
  if (stimuli.empty()) faults = "\n  no stimuli: a simulated participant needs at least one";
  for (std::size_t i = 0; i < stimuli.size(); ++i) {
    const std::string fault = fault_of(stimuli[i]);
    if (!fault.empty()) faults += "\n  stimulus " + std::to_string(i + 1) + ": " + fault;
  }
  if (!faults.empty()) {
    throw std::invalid_argument("these stimuli cannot be simulated:" + faults);
  }
  for (const stimuli::ObjectSpec& stimulus : stimuli) append(stimulus);
}

void ShapeHypotheses::append(const stimuli::ObjectSpec& stimulus) {
  Shape shape;
  shape.kind = stimulus.shape;
  std::vector<Mat3> rotations;
  if (has_formula(stimulus)) {
    rotations = formula_rotations(stimulus.shape);
    shape.radius = static_cast<float>(stimulus.radius);
    shape.half_size = static_cast<float>(
        (stimuli::traits_of(stimulus.shape).height ? stimulus.height : stimulus.edge) / 2);
  } else {
    const std::vector<PlacedPart> parts = felt_parts(stimulus);
    if (parts.empty()) throw std::invalid_argument("a stimulus has no surface that can be felt");
    shape.field = std::make_shared<const DistanceField>(parts);
    rotations = distinct_rotations(symmetries(parts, *shape.field));
  }
  shape.first = padded_size();
  shape.count = static_cast<int>(rotations.size());
  shapes_.push_back(shape);

  const int blocks = (shape.count + kBlock - 1) / kBlock;
  for (int i = 0; i < blocks * kBlock; ++i) {
    const Mat3& r = rotations[static_cast<std::size_t>(i < shape.count ? i : shape.count - 1)];
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t c = 0; c < 3; ++c) {
        axes_[a][c].push_back(static_cast<float>(r[static_cast<int>(a)][static_cast<int>(c)]));
      }
    }
  }
  append_order(shape);
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::vector<float>& all = axes_[a][c];
      for (std::size_t i = nearby_axes_[a][c].size(); i < all.size(); ++i)
        nearby_axes_[a][c].push_back(all[static_cast<std::size_t>(nearby_order_[i])]);
    }
  }
}

/// Along a Z-order curve through the directions of two axes (Morton 1966).
void ShapeHypotheses::append_order(const Shape& shape) {
  const auto end = static_cast<std::size_t>(padded_size());
  for (auto i = static_cast<std::size_t>(shape.first); i < end; ++i)
    nearby_order_.push_back(static_cast<int>(i));
  if (!shape.field) return;
  constexpr int kBits = 4;
  const auto place_on_curve = [&](int hypothesis) {
    std::uint32_t place = 0;
    for (int bit = kBits - 1; bit >= 0; --bit) {
      for (const std::size_t a : {std::size_t{0}, std::size_t{2}}) {
        for (std::size_t c = 0; c < 3; ++c) {
          const float share = 0.5F * (axes_[a][c][static_cast<std::size_t>(hypothesis)] + 1);
          const auto cell =
              static_cast<std::uint32_t>(std::clamp(share, 0.0F, 0.999F) * (1 << kBits));
          place = place << 1U | (cell >> static_cast<unsigned>(bit) & 1U);
        }
      }
    }
    return place;
  };
  const auto from = nearby_order_.begin() + shape.first;
  std::stable_sort(from, from + shape.count,
                   [&](int a, int b) { return place_on_curve(a) < place_on_curve(b); });
}

ShapeHypotheses ShapeHypotheses::one_block_each(const ShapeHypotheses& all) {
  ShapeHypotheses few;
  for (Shape shape : all.shapes_) {
    const int from = shape.first;
    shape.first = static_cast<int>(few.shapes_.size()) * kBlock;
    shape.count = kBlock;
    few.shapes_.push_back(shape);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = all.axes_[a][c][static_cast<std::size_t>(from)];
        few.axes_[a][c].insert(few.axes_[a][c].end(), kBlock, value);
      }
    }
  }
  few.nearby_order_.resize(few.axes_[0][0].size());
  std::iota(few.nearby_order_.begin(), few.nearby_order_.end(), 0);
  few.nearby_axes_ = few.axes_;
  return few;
}

void ShapeHypotheses::copy_rotation(int to, const ShapeHypotheses& all, int from) {
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = all.axes_[a][c][static_cast<std::size_t>(from)];
      axes_[a][c][static_cast<std::size_t>(to)] = value;
      nearby_axes_[a][c][static_cast<std::size_t>(to)] = value;
    }
  }
}

Mat3 ShapeHypotheses::rotation(int hypothesis) const {
  Mat3 r;
  for (int a = 0; a < 3; ++a) {
    for (int c = 0; c < 3; ++c) r[a][c] = axis_component(a, c)[hypothesis];
  }
  return r;
}

}  // namespace palpate::runner::participants
