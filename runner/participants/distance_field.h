#pragma once
// Signed distance to a union of convex parts and closed surfaces, on a grid: the simulated
// participant's model of a stimulus without a formula.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "runner/participants/lane_math.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/large_array.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

/// A convex part, or a closed surface, in the frame of its stimulus.
struct PlacedPart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;  ///< null: a surface
  Pose pose;
  std::shared_ptr<const stimuli::ClosedSurface> surface = nullptr;

  /// Calls visit(place) for each of its corners.
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

/// Up to six spacings outside, nodes are exact (the least distance of the parts). Inside, nodes
/// have the distance to the surface of the union, without seams, within a tenth of the spacing near
/// the surface. Farther off the error is a few percent. Between nodes the field is linear in each
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
    float slope_x, slope_y, slope_z;  ///< its gradient; of length 1 except at rounded edges
  };

  /// kMost: most places at once, a multiple of kLanes.
  static constexpr int kMost = 32, kLanes = 16;
  struct Places {
    float x[kMost], y[kMost], z[kMost];  // m
  };
  struct Values {
    float distance[kMost], slope_x[kMost], slope_y[kMost], slope_z[kMost];
  };
  /// \param count  number of places; the arrays are read up to the next multiple of kLanes
  void distances(const Places& places, int count, float* out) const {
    Cells cells;
    find_cells(places, count, cells);
    Four along_x[kMost];
    for (int i = 0; i < count; ++i) {
      const Corners corners = corners_of(cells.node[i]);
      along_x[i] = corners.low + cells.x[i] * (corners.high - corners.low);
    }
    for (int first = 0; first < count; first += kLanes) {
      for (int i = first; i < first + kLanes; ++i) {
        const Four& at = along_x[i];
        out[i] = mix(mix(at[0], at[1], cells.y[i]), mix(at[2], at[3], cells.y[i]), cells.z[i]) +
                 cells.beyond[i];
      }
    }
  }
  void values(const Places& places, int count, Values& out) const {
    Cells cells;
    find_cells(places, count, cells);
    Four along_x[kMost], step_x[kMost];
    for (int i = 0; i < count; ++i) {
      const Corners corners = corners_of(cells.node[i]);
      step_x[i] = corners.high - corners.low;
      along_x[i] = corners.low + cells.x[i] * step_x[i];
    }
    for (int first = 0; first < count; first += kLanes) {
      for (int i = first; i < first + kLanes; ++i) {
        const Four &at = along_x[i], &step = step_x[i];
        const float y = cells.y[i], z = cells.z[i];
        const float y0 = mix(at[0], at[1], y), y1 = mix(at[2], at[3], y);
        out.distance[i] = mix(y0, y1, z) + cells.beyond[i];
        out.slope_x[i] = mix(mix(step[0], step[1], y), mix(step[2], step[3], y), z) * per_spacing_;
        out.slope_y[i] = mix(at[1] - at[0], at[3] - at[2], z) * per_spacing_;
        out.slope_z[i] = (y1 - y0) * per_spacing_;
      }
    }
  }
  float distance(float x, float y, float z) const {
    float out[kMost];
    distances(all_at(x, y, z), 1, out);
    return out[0];
  }
  Value value(float x, float y, float z) const {
    Values out;
    values(all_at(x, y, z), 1, out);
    return {out.distance[0], out.slope_x[0], out.slope_y[0], out.slope_z[0]};
  }

  /// m; a place is at least its distance from the origin less this away from the solid.
  float reach() const { return reach_; }

 private:
  using Two = float __attribute__((vector_size(8)));
  using Four = float __attribute__((vector_size(16)));
  /// The values at the corners of a cell: at its lowest and highest x, each at the lowest (y, z),
  /// the next y, the next z, and both.
  struct Corners {
    Four low, high;
  };
  Corners corners_of(std::int32_t node) const {
    const float* const at = nodes_.data() + node;
    const auto pair = [](const float* from) {
      Two out;
      std::memcpy(&out, from, sizeof out);
      return out;
    };
    const Two a = pair(at), b = pair(at + row_), c = pair(at + layer_),
              d = pair(at + layer_ + row_);
    const Four front = __builtin_shufflevector(a, b, 0, 1, 2, 3);
    const Four back = __builtin_shufflevector(c, d, 0, 1, 2, 3);
    return {__builtin_shufflevector(front, back, 0, 2, 4, 6),
            __builtin_shufflevector(front, back, 1, 3, 5, 7)};
  }

  // Written for vectorised loops over lanes: 32-bit integers, no branches.
  struct Coordinate {
    std::int32_t cell;
    float fraction;  // within the cell
    float off;       // m, beyond the grid
  };
  Coordinate coordinate(std::size_t axis, float p) const {
    const float steps = (p - origin_[axis]) * per_spacing_;
    const float inside = lane::min(lane::max(steps, 0.0F), last_[axis]);
    const auto cell = static_cast<std::int32_t>(lane::min(inside, last_[axis] - 1));
    return {cell, inside - static_cast<float>(cell), (steps - inside) * step_};
  }
  struct Cells {
    std::int32_t node[kMost];            // lowest node of the cell
    float x[kMost], y[kMost], z[kMost];  // fractions within the cell
    float beyond[kMost];                 // m, beyond the grid
  };
  void find_cells(const Places& places, int count, Cells& out) const {
    for (int first = 0; first < count; first += kLanes) {
      for (int i = first; i < first + kLanes; ++i) {
        const Coordinate a = coordinate(0, places.x[i]), b = coordinate(1, places.y[i]),
                         c = coordinate(2, places.z[i]);
        out.node[i] = (c.cell * count_[1] + b.cell) * count_[0] + a.cell;
        out.x[i] = a.fraction;
        out.y[i] = b.fraction;
        out.z[i] = c.fraction;
        out.beyond[i] = std::sqrt(a.off * a.off + b.off * b.off + c.off * c.off);
      }
    }
  }
  static Places all_at(float x, float y, float z) {
    Places out;
    std::fill_n(out.x, kLanes, x);
    std::fill_n(out.y, kLanes, y);
    std::fill_n(out.z, kLanes, z);
    return out;
  }
  static float mix(float a, float b, float t) { return a + t * (b - a); }

  Vec3 low_, high_;
  double spacing_ = 0, margin_ = 0;
  std::array<std::int32_t, 3> count_{};  // nodes
  std::array<float, 3> origin_{}, last_{};
  float per_spacing_ = 0, step_ = 0;
  float reach_ = 0;                   // m
  std::int32_t row_ = 0, layer_ = 0;  // nodes, from one to the next in y and in z
  stimuli::LargeArray<float> nodes_;  // m, x fastest
};

}  // namespace palpate::runner::participants
