#pragma once
// Signed distance to any union of convex parts, on a grid: what a simulated participant imagines of
// a stimulus that has no formula.

#include <array>
#include <cmath>
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
    const std::array<float, 8> v = corners(at);
    const float x00 = v[0] + at.x * (v[1] - v[0]), x10 = v[2] + at.x * (v[3] - v[2]);
    const float x01 = v[4] + at.x * (v[5] - v[4]), x11 = v[6] + at.x * (v[7] - v[6]);
    const float y0 = x00 + at.y * (x10 - x00), y1 = x01 + at.y * (x11 - x01);
    return y0 + at.z * (y1 - y0) + at.beyond;
  }
  Value value(float x, float y, float z) const;

 private:
  struct Place {
    std::size_t node;  // the lowest of its cell
    float x, y, z;     // fractions within the cell
    float beyond;      // m, out of the grid
  };
  Place place(float x, float y, float z) const {
    const std::array<float, 3> p{x, y, z};
    std::array<std::size_t, 3> cell{};
    std::array<float, 3> fraction{};
    float beyond2 = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const float steps = (p[a] - origin_[a]) * per_spacing_;
      const float inside = lane::min(lane::max(steps, 0.0F), last_[a]);
      const float off = (steps - inside) * step_;
      beyond2 += off * off;
      cell[a] = static_cast<std::size_t>(lane::min(inside, last_[a] - 1));
      fraction[a] = inside - static_cast<float>(cell[a]);
    }
    return {(cell[2] * count_[1] + cell[1]) * count_[0] + cell[0], fraction[0], fraction[1],
            fraction[2], beyond2 > 0 ? std::sqrt(beyond2) : 0.0F};
  }
  std::array<float, 8> corners(const Place& at) const {
    const float* const n = nodes_.data() + at.node;
    const std::size_t up = count_[0] * count_[1];
    return {n[0],  n[1],      n[count_[0]],      n[count_[0] + 1],
            n[up], n[up + 1], n[up + count_[0]], n[up + count_[0] + 1]};
  }

  Vec3 low_, high_;
  double spacing_ = 0, margin_ = 0;
  std::array<std::size_t, 3> count_{};  // nodes
  std::array<float, 3> origin_{}, last_{};
  float per_spacing_ = 0, step_ = 0;
  std::vector<float> nodes_;  // m, x fastest
};

}  // namespace palpate::runner
