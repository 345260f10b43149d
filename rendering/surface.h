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

/// Bits for the parts of a triangle and a segment that can touch.
namespace surface_pair {
inline constexpr std::uint8_t kSides = 7;  ///< bit k: side k, which is the triangle's own
inline constexpr std::uint8_t kTip = 8, kTail = 16;
inline constexpr std::uint8_t kAll = 31;
}  // namespace surface_pair

/// A segment whose ends move linearly, with room about them.
struct SegmentMotion {
  Vec3 start, end;          ///< m, the ends at first
  Vec3 start_way, end_way;  ///< m, their motion
  double start_room = 0;    ///< m; the start may be so far off
  double end_room = 0;      ///< m; the same of the end, and of points between interpolated
  double turn = 0;          ///< m; one end may be so far off relative to the other
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

  /// Of the tree: the boxes of up to eight children side by side, relative to the centre, in single
  /// precision and rounded outwards. An unused box is empty.
  static constexpr std::size_t kWidth = 8;
  using Lanes = float __attribute__((vector_size(sizeof(float) * kWidth)));
  struct alignas(64) Node {
    std::array<Lanes, 3> low{}, high{};
    std::array<std::uint32_t, kWidth> children{};  ///< of a leaf: triangles; else nodes
    bool leaf = false;
  };
  /// For each child a ball around the normals of its triangles and of their neighbours across
  /// touched edges.
  struct alignas(64) Normals {
    std::array<Lanes, 3> middle{};
    Lanes radius{};
  };

  // Searches; defined in surface_search.h.

  /// Calls visit(triangle) for all triangles that meet the segment, and for some others near it.
  /// \param visit  returns whether to continue
  template <class Visit>
  void near_segment(const Vec3& start, const Vec3& along, const Visit& visit) const;
  /// Calls visit(triangle, what) for all triangles that the segment can touch within the motion:
  /// with an end, or on a silhouette edge that the triangle owns. Also visits some that it cannot
  /// touch. \param visit  `what`: bits of surface_pair; returns whether to continue
  template <class Visit>
  void touchable(const SegmentMotion& motion, const Visit& visit) const;

  /// How often the surface winds round a point that does not lie on it.
  int winding(const Vec3& point) const;

 private:
  void add(const SurfaceShell& shell);
  void find_edges();
  void build_tree();
  std::uint32_t build_node(std::span<const Vec3> middles, std::span<std::uint32_t> triangles);
  void set_box(std::span<const std::uint32_t> triangles, std::size_t child, Node& node) const;
  void set_normals(std::span<const std::uint32_t> triangles, std::size_t child,
                   Normals& normals) const;

  stimuli::LargeArray<Vec3> vertices_;
  stimuli::LargeArray<SurfaceTriangle> triangles_;
  std::vector<stimuli::Material> materials_;
  stimuli::LargeArray<Node> nodes_;
  stimuli::LargeArray<Normals> normals_;  // by node
  Vec3 centre_;
  double radius_ = 0;
};

}  // namespace palpate::rendering
