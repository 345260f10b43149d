#pragma once
// Signed distance to a union of convex parts and closed surfaces, on a grid: the simulated
// participant's model of a stimulus without a formula.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "runner/participants/lane_math.h"
#include "stimuli/closed_surface.h"
#include "stimuli/large_array.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::participants {

/// A convex part, or a closed surface, in the frame of its stimulus.
struct PlacedPart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;  ///< null: a surface
  Pose pose;
  std::shared_ptr<const stimuli::ClosedSurface> surface = nullptr;

  /// Calls visit(place) for each of its corners.
  void for_each_corner(const std::function<void(const Vec3&)>& visit) const;
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

  struct Values {
    lane::Floats distance, slope_x, slope_y, slope_z;
  };
  /// At one place for each lane.
  lane::Floats distances(const lane::Floats& x, const lane::Floats& y,
                         const lane::Floats& z) const {
    const Cells cells = cells_of(x, y, z);
    lane::Floats at[4];
    for (int k = 0; k < 4; ++k) {
      const lane::Pairs side = side_of(cells, k);
      at[k] = lane::mix(side.first, side.second, cells.x);
    }
    return lane::mix(lane::mix(at[0], at[1], cells.y), lane::mix(at[2], at[3], cells.y), cells.z) +
           cells.beyond;
  }
  Values values(const lane::Floats& x, const lane::Floats& y, const lane::Floats& z) const {
    const Cells cells = cells_of(x, y, z);
    lane::Floats at[4], step[4];
    for (int k = 0; k < 4; ++k) {
      const lane::Pairs side = side_of(cells, k);
      step[k] = side.second - side.first;
      at[k] = side.first + cells.x * step[k];
    }
    const lane::Floats y0 = lane::mix(at[0], at[1], cells.y), y1 = lane::mix(at[2], at[3], cells.y);
    const lane::Floats x0 = lane::mix(step[0], step[1], cells.y),
                       x1 = lane::mix(step[2], step[3], cells.y);
    return {lane::mix(y0, y1, cells.z) + cells.beyond, lane::mix(x0, x1, cells.z) * per_spacing_,
            lane::mix(at[1] - at[0], at[3] - at[2], cells.z) * per_spacing_,
            (y1 - y0) * per_spacing_};
  }
  float distance(float x, float y, float z) const {
    return distances(lane::all(x), lane::all(y), lane::all(z))[0];
  }
  Value value(float x, float y, float z) const {
    const Values v = values(lane::all(x), lane::all(y), lane::all(z));
    return {v.distance[0], v.slope_x[0], v.slope_y[0], v.slope_z[0]};
  }

  /// m; a place is at least its distance from the origin less this away from the solid.
  float reach() const { return reach_; }

  /// A place that is beyond one of its planes by some length is at least that far from the solid.
  struct Box {
    float middle[3], half[3];  // m
  };
  const Box& box() const { return box_; }

 private:
  struct Cells {
    lane::Ints node;       // lowest node of the cell
    lane::Floats x, y, z;  // fractions within the cell
    lane::Floats beyond;   // m, beyond the grid
  };
  Cells cells_of(const lane::Floats& x, const lane::Floats& y, const lane::Floats& z) const {
    lane::Floats steps[3] = {(x - origin_[0]) * per_spacing_, (y - origin_[1]) * per_spacing_,
                             (z - origin_[2]) * per_spacing_};
    lane::Ints cell[3];
    lane::Floats beyond{};
    // Most places are inside, which takes half the operations.
    if (lane::all_within(steps, last_.data())) {
      for (int a = 0; a < 3; ++a) cell[a] = __builtin_convertvector(steps[a], lane::Ints);
    } else {
      lane::Floats squares{};
      for (std::size_t a = 0; a < 3; ++a) {
        const lane::Floats last = lane::all(last_[a]);
        const lane::Floats inside = lane::min(lane::max(steps[a], lane::Floats{}), last);
        const lane::Floats off = (steps[a] - inside) * step_;
        squares += off * off;
        cell[a] = __builtin_convertvector(lane::min(inside, last - 1.0F), lane::Ints);
        steps[a] = inside;
      }
      beyond = lane::sqrt(squares);
    }
    const auto fraction = [&](int a) {
      return steps[a] - __builtin_convertvector(cell[a], lane::Floats);
    };
    return {cell[2] * layer_ + (cell[1] * row_ + cell[0]), fraction(0), fraction(1), fraction(2),
            beyond};
  }
  /// The values at the lowest and highest x of the cells; k: at their lowest (y, z), the next y,
  /// the next z, and both.
  lane::Pairs side_of(const Cells& cells, int k) const {
    return lane::pairs(nodes_.data() + (k % 2 != 0 ? row_ : 0) + (k / 2 != 0 ? layer_ : 0),
                       cells.node);
  }

  Vec3 low_, high_;
  double spacing_ = 0, margin_ = 0;
  std::array<std::int32_t, 3> count_{};  // nodes
  std::array<float, 3> origin_{}, last_{};
  float per_spacing_ = 0, step_ = 0;
  float reach_ = 0;  // m
  Box box_{};
  std::int32_t row_ = 0, layer_ = 0;  // nodes, from one to the next in y and in z
  stimuli::LargeArray<float> nodes_;  // m, x fastest
};

}  // namespace palpate::runner::participants
