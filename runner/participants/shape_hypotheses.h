#pragma once
// The hypotheses of a simulated participant: every stimulus in every distinguishable orientation.

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "runner/participants/distance_field.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

/// The surface at which a stimulus is felt first: the convex parts of the outermost surface that
/// has a stiffness, relative to the centre of the workspace. That is the object's surface or, if
/// its stiffness is 0, the uppermost layer with a stiffness. The simulated participant does not
/// know the layers below it.
/// \throws MeshError
std::vector<PlacedPart> felt_parts(const stimuli::ObjectSpec& stimulus);

/// Whether there is such a surface.
bool can_be_felt(const stimuli::ObjectSpec& stimulus);

/// The rotations about the origin that map a solid to itself, the identity first: its field then
/// changes by at most a fifth of its spacing (root mean square, near the surface). An axis of
/// symmetry runs through a corner, or the middle of an edge or a facet, of the convex hull; turns
/// by 360 degrees over 2 to 32 are tried about each.
std::vector<Quat> symmetries(const std::vector<PlacedPart>& parts, const DistanceField& field);

/// The distinguishable orientations of a stimulus, some 11 to 14 degrees apart: of each set that is
/// equivalent by symmetry, the smallest.
std::vector<Mat3> distinct_rotations(const std::vector<Quat>& group);

/// Shape x rotation grid modulo the shape's symmetry. Immutable, so threads can share it. A
/// stimulus is represented by the surface that is felt first (felt_parts), placed relative to the
/// centre of the workspace. The four analytic shapes, if centred, have formulas. Any other stimulus
/// has a distance field and some 4600 rotations 14 degrees apart; with symmetries fewer, 11 degrees
/// apart. Sphere: 1 hypothesis. Cone: 380 directions of the axis. Cylinder: 150 undirected axes.
/// Cube: 384 rotations modulo its 24. Neighbours are 10 to 12 degrees apart; no orientation is
/// further than 8, 10 and 12 degrees from the grid of cone, cylinder and cube.
///
/// Stored in flat single-precision arrays; a shape fills whole blocks, the last one padded with its
/// last hypothesis.
class ShapeHypotheses {
 public:
  static constexpr int kBlock = 32;

  struct Shape {
    stimuli::ShapeKind kind = stimuli::ShapeKind::sphere;
    float radius = 0;     ///< m; sphere, cone, cylinder
    float half_size = 0;  ///< m; half the height of a cone or cylinder, half the edge of a cube
    std::shared_ptr<const DistanceField> field;  ///< of a stimulus without a formula
    int first = 0;  ///< index of its first hypothesis, a multiple of kBlock
    int count = 0;  ///< number of hypotheses, padding excluded
  };

  /// The reason why a stimulus cannot be simulated; empty: it can.
  static std::string fault_of(const stimuli::ObjectSpec& stimulus);

  /// Shape i is stimulus i. \throws std::invalid_argument naming every stimulus with a size that is
  /// not positive or that cannot be felt; also for an empty list. MeshError.
  explicit ShapeHypotheses(const std::vector<stimuli::ObjectSpec>& stimuli);

  /// One block for each shape of `all`, to be filled by copy_rotation, to evaluate a few of its
  /// hypotheses. Initially all are the first hypothesis of their shape.
  static ShapeHypotheses one_block_each(const ShapeHypotheses& all);
  /// Sets hypothesis `to` to hypothesis `from` of `all`, of the same shape. Does not allocate.
  void copy_rotation(int to, const ShapeHypotheses& all, int from);

  const std::vector<Shape>& shapes() const { return shapes_; }

  int padded_size() const { return static_cast<int>(axes_[0][0].size()); }

  /// The hypotheses once more, each shape's so that those of similar rotations are side by side:
  /// what looks at the grid of a field in this order finds it in the cache.
  const int* nearby_order() const { return nearby_order_.data(); }
  /// axis_component in that order.
  const float* nearby_component(int a, int c) const { return nearby_axes_[a][c].data(); }

  /// Component c of local axis a (x, y, z: 0, 1, 2) in the world frame, of every hypothesis.
  const float* axis_component(int a, int c) const { return axes_[a][c].data(); }

  /// World from local, of one hypothesis; columns are the local axes.
  Mat3 rotation(int hypothesis) const;

 private:
  ShapeHypotheses() = default;
  void append(const stimuli::ObjectSpec& stimulus);
  void append_order(const Shape& shape);

  std::vector<Shape> shapes_;
  std::array<std::array<std::vector<float>, 3>, 3> axes_;  // axis, component
  std::vector<int> nearby_order_;
  std::array<std::array<std::vector<float>, 3>, 3> nearby_axes_;
};

}  // namespace palpate::runner::participants
