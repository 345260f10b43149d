#pragma once
// A closed surface of triangles, prepared for the law of surfaces (surface_contact.h): planes, what
// lies beyond each side, which edges a segment can touch, a tree over the triangles. Local frame,
// m.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/closed_surface.h"
#include "stimuli/large_array.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// One cache line.
struct alignas(64) SurfaceTriangle {
  Vec3 normal;                             ///< unit, outward
  double offset = 0;                       ///< m; the plane is dot(normal, p) == offset
  std::array<std::uint32_t, 3> corners{};  ///< counter-clockwise seen from outside
  /// Side k is from corner k to corner k + 1. The neighbour's index times four, plus its side.
  std::array<std::uint32_t, 3> across{};
  std::uint32_t shell = 0;    ///< index in Surface::materials()
  std::uint32_t touched = 0;  ///< bit k: side k is not concave, so a segment can touch it

  static constexpr std::uint32_t triangle_of(std::uint32_t side) { return side >> 2; }
  static constexpr std::uint32_t side_of(std::uint32_t side) { return side & 3; }
  bool touches(std::uint32_t k) const { return (touched >> k & 1) != 0; }
};

/// Whether this triangle owns the side k that it shares with another.
inline bool owns(const SurfaceTriangle& triangle, std::uint32_t index, std::uint32_t k) {
  return triangle.across[k] > (index << 2 | k);
}

/// A closed surface as it stands in an object.
struct SurfaceShell {
  std::shared_ptr<const stimuli::ClosedSurface> surface;
  Pose pose;  ///< in the object
  stimuli::Material material;
};

/// Immutable. Several shells, which may overlap, are one surface: the solid is their union.
class Surface {
 public:
  explicit Surface(std::span<const SurfaceShell> shells);

  const stimuli::LargeArray<Vec3>& vertices() const { return vertices_; }
  const stimuli::LargeArray<SurfaceTriangle>& triangles() const { return triangles_; }
  const std::vector<stimuli::Material>& materials() const { return materials_; }
  Vec3 centre() const { return centre_; }    ///< of a sphere about it
  double radius() const { return radius_; }  ///< m, of that sphere
  double size() const { return 2 * radius_; }

  /// Of the tree: a box in single precision, rounded outwards.
  struct Node {
    std::array<float, 3> middle, half;
    std::uint32_t first = 0;  ///< leaf: of order(); else the right child, the left one is the next
    std::uint32_t count = 0;  ///< leaf: triangles; else 0
  };
  /// A ball around the normals of a node's triangles and their neighbours across touched edges.
  struct Normals {
    std::array<float, 3> middle;
    float radius = 0;
  };
  const stimuli::LargeArray<Node>& nodes() const { return nodes_; }
  const stimuli::LargeArray<std::uint32_t>& order() const { return order_; }

  /// Calls visit(triangle) for all triangles within `room` of the segment, and for some farther
  /// ones. Defined in surface_patch.h. \param visit  returns whether to continue
  template <class Visit>
  void near_segment(const Vec3& start, const Vec3& along, double room, const Visit& visit) const;

  /// How far a segment may move. Points between its ends move by the interpolated distance.
  struct Motion {
    double start = 0, end = 0;  ///< m
    double turn = 0;            ///< m; one end relative to the other
  };
  /// Calls visit(triangle) for all triangles that the segment can touch within the motion: with an
  /// end, or on a silhouette edge that the triangle owns. Also visits some that it cannot touch.
  /// \param visit  returns whether to continue
  template <class Visit>
  void touchable(const Vec3& start, const Vec3& along, const Motion& motion,
                 const Visit& visit) const;

  /// How often the surface winds round a point that does not lie on it.
  int winding(const Vec3& point) const;

 private:
  void add(const SurfaceShell& shell);
  void find_edges();
  void build_tree();
  std::uint32_t build_node(std::span<const Vec3> middles, std::uint32_t begin, std::uint32_t end);
  Normals normals_of(std::uint32_t begin, std::uint32_t end) const;

  stimuli::LargeArray<Vec3> vertices_;
  stimuli::LargeArray<SurfaceTriangle> triangles_;
  std::vector<stimuli::Material> materials_;
  stimuli::LargeArray<Node> nodes_;
  stimuli::LargeArray<Normals> normals_;  // by node
  stimuli::LargeArray<std::uint32_t> order_;
  Vec3 centre_;
  double radius_ = 0;
};

}  // namespace palpate::rendering
