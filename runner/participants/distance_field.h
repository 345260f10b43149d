#pragma once
// Signed distance to any union of convex parts, on a grid: what a simulated participant imagines of
// a stimulus that has no formula.

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "runner/participants/lane_math.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/vec.h"

namespace palpate::runner {

/// A convex part, or a closed surface, in the frame of its stimulus.
struct PlacedPart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;  ///< null: a surface
  Pose pose;
  std::shared_ptr<const stimuli::ClosedSurface> surface = nullptr;

  /// Calls visit(place) for its corners.
  template <class Visit>
  void for_each_corner(const Visit& visit) const {
    const auto all = [&](const auto& vertices) {
      for (const Vec3& vertex : vertices) visit(pose.orientation * vertex + pose.position);
    };
    if (mesh != nullptr)
      all(mesh->vertices());
    else
      all(surface->vertices);
  }
};

/// At the nodes up to six spacings outside it is exact (the least distance of the parts); inside it
/// is that to the surface of the union, whatever seams run there, within a tenth of the spacing
/// near the surface; farther off within a few percent. Between nodes it is linear in each
/// coordinate, so sharp edges and corners are rounded by up to half a spacing, some 0.7 mm at the
/// size of a hand. Beyond the grid, which ends `margin()` from the object, the distance to the grid
/// is added: an upper bound.
class DistanceField {
 public:
  /// \param parts  at least one
  explicit DistanceField(const std::vector<PlacedPart>& parts);

  double spacing() const { return spacing_; }  ///< m, of the nodes
  double margin() const { return margin_; }    ///< m
  Vec3 low() const { return low_; }            ///< m, the first node
  Vec3 high() const { return high_; }          ///< m, the last one

  struct Value {
    float distance;                   ///< m, negative inside
    float slope_x, slope_y, slope_z;  ///< its gradient; of length 1 but for rounding at edges
  };
  float distance(float x, float y, float z) const {
    const Place at = place(x, y, z);
    const Corners v = corners(at);
    const float y0 = mix(mix(v.v000, v.v100, at.x), mix(v.v010, v.v110, at.x), at.y);
    const float y1 = mix(mix(v.v001, v.v101, at.x), mix(v.v011, v.v111, at.x), at.y);
    return mix(y0, y1, at.z) + at.beyond;
  }
  Value value(float x, float y, float z) const {
    const Place at = place(x, y, z);
    const Corners v = corners(at);
    const float x00 = mix(v.v000, v.v100, at.x), x10 = mix(v.v010, v.v110, at.x);
    const float x01 = mix(v.v001, v.v101, at.x), x11 = mix(v.v011, v.v111, at.x);
    const float y0 = mix(x00, x10, at.y), y1 = mix(x01, x11, at.y);
    const float dx = mix(mix(v.v100 - v.v000, v.v110 - v.v010, at.y),
                         mix(v.v101 - v.v001, v.v111 - v.v011, at.y), at.z);
    const float dy = mix(x10 - x00, x11 - x01, at.z);
    return {mix(y0, y1, at.z) + at.beyond, dx * per_spacing_, dy * per_spacing_,
            (y1 - y0) * per_spacing_};
  }

 private:
  // Written so that loops over lanes are vectorised: whole numbers of 32 bits, no branches.
  struct Coordinate {
    std::int32_t cell;
    float fraction;  // within the cell
    float off;       // m, out of the grid
  };
  Coordinate coordinate(std::size_t axis, float p) const {
    const float steps = (p - origin_[axis]) * per_spacing_;
    const float inside = lane::min(lane::max(steps, 0.0F), last_[axis]);
    const auto cell = static_cast<std::int32_t>(lane::min(inside, last_[axis] - 1));
    return {cell, inside - static_cast<float>(cell), (steps - inside) * step_};
  }
  struct Place {
    std::int32_t node;  // the lowest of its cell
    float x, y, z;      // fractions within the cell
    float beyond;       // m, out of the grid
  };
  Place place(float x, float y, float z) const {
    const Coordinate a = coordinate(0, x), b = coordinate(1, y), c = coordinate(2, z);
    return {(c.cell * count_[1] + b.cell) * count_[0] + a.cell, a.fraction, b.fraction, c.fraction,
            std::sqrt(a.off * a.off + b.off * b.off + c.off * c.off)};
  }
  struct Corners {
    float v000, v100, v010, v110, v001, v101, v011, v111;
  };
  Corners corners(const Place& at) const {
    const float* const n = nodes_.data();
    const std::int32_t row = count_[0], up = row * count_[1], i = at.node;
    return {n[i],      n[i + 1],      n[i + row],      n[i + row + 1],
            n[i + up], n[i + up + 1], n[i + up + row], n[i + up + row + 1]};
  }
  static float mix(float a, float b, float t) { return a + t * (b - a); }

  Vec3 low_, high_;
  double spacing_ = 0, margin_ = 0;
  std::array<std::int32_t, 3> count_{};  // nodes
  std::array<float, 3> origin_{}, last_{};
  float per_spacing_ = 0, step_ = 0;
  std::vector<float> nodes_;  // m, x fastest
};

}  // namespace palpate::runner
