#include "runner/participants/shape_hypotheses.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

#include "runner/participants/felt_parts.h"
#include "runner/participants/rotation_grid.h"
#include "stimuli/shapes.h"

namespace palpate::runner::participants {
namespace {

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
