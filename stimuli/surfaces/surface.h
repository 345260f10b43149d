#pragma once
// A closed surface of triangles, prepared for the law of surfaces (surface_contact.h): planes, what
// lies beyond each side, which edges a segment can touch, a tree over the triangles. Local frame,
// m.

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/closed_surface.h"
#include "stimuli/large_array.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// One cache line.
struct alignas(64) SurfaceTriangle {
  Vec3 normal;                             ///< unit, outward
  double offset = 0;                       ///< m; the plane is dot(normal, p) == offset
  std::array<std::uint32_t, 3> corners{};  ///< counter-clockwise seen from outside
  /// Side k is from corner k to corner k + 1. The neighbour's index times four, plus its side.
  std::array<std::uint32_t, 3> across{};
  std::uint32_t shell = 0;  ///< index in Surface::materials()
  /// Bit k: side k is not concave, so a segment can touch it, or folded. Bit 3 + k: it is folded.
  /// Bit 6 + k: nothing lies beyond side k of a back. Bit 9: it is a back, the reverse of another
  /// triangle, so that no tool gets into a pocket (ClosedSurface::at_pockets). Bit 10: it shares
  /// its plane with others, to the bit, and a corner may lie above it by rounding.
  std::uint16_t touched = 0;
  std::uint16_t owned = 0;  ///< bit k: of the two triangles at side k it is the first in its file

  static constexpr std::uint32_t triangle_of(std::uint32_t side) { return side >> 2; }
  static constexpr std::uint32_t side_of(std::uint32_t side) { return side & 3; }
  bool touches(std::uint32_t k) const { return (touched >> k & 1) != 0; }
  bool folded(std::uint32_t k) const { return (touched >> (3 + k) & 1) != 0; }
  bool ends(std::uint32_t k) const { return (touched >> (6 + k) & 1) != 0; }
  bool is_back() const { return (touched & kBack) != 0; }
  bool shares_plane() const { return (touched & kSharesPlane) != 0; }
  static constexpr std::uint16_t kBack = 1U << 9, kSharesPlane = 1U << 10;
  bool owns(std::uint32_t k) const { return (owned >> k & 1) != 0; }
};

/// A closed surface as it stands in an object.
struct SurfaceShell {
  std::shared_ptr<const ClosedSurface> surface;
  Pose pose;  ///< in the object
  Material material;
  double pose_error = 0;  ///< m, of its corners, as the pose's numbers are rounded
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
  double room = 0;          ///< m; each point may be so far off
  double turn = 0;          ///< m; one end may be so far off relative to the other
};

/// Immutable. Several shells, which may overlap, are one surface: the solid is their union.
class Surface {
 public:
  explicit Surface(std::span<const SurfaceShell> shells);

  const LargeArray<Vec3>& vertices() const { return vertices_; }
  /// Near triangles are near in the array.
  const LargeArray<SurfaceTriangle>& triangles() const { return triangles_; }
  const std::vector<Material>& materials() const { return materials_; }
  Vec3 centre() const { return centre_; }    ///< of a sphere about it
  double radius() const { return radius_; }  ///< m, of that sphere
  double size() const { return 2 * radius_; }
  /// m, the widest gap or step that rounding of coordinates has made between faces of two shells
  /// that abut; 0: none
  double seam() const { return seam_; }

  /// Of the tree: up to eight children side by side, relative to the centre, in single precision.
  static constexpr std::size_t kWidth = 8;
  using Lanes = float __attribute__((vector_size(sizeof(float) * kWidth)));
  struct alignas(64) Node {
    std::array<Lanes, 3> low{}, high{};  ///< m, boxes, rounded outwards; an unused one is empty
    /// A ball around the normals of the triangles and of their neighbours across touched edges.
    std::array<Lanes, 3> middle{};
    Lanes radius{};
    Lanes top{};  ///< m; no triangle is higher in the direction of the ball's middle
    std::array<std::uint32_t, kWidth> children{};  ///< of a leaf: triangles; else names of nodes
  };
  /// The name of a node: its index times two, plus 1 for a leaf.
  static constexpr std::uint32_t index_of(std::uint32_t node) { return node >> 1; }
  static constexpr bool is_leaf(std::uint32_t node) { return (node & 1) != 0; }

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

  /// Indices in triangles() in the order of the files, without backs.
  const std::vector<std::uint32_t>& file_order() const { return file_order_; }

  /// How often the surface winds round a point that does not lie on it.
  int winding(const Vec3& point) const;

 private:
  void add(const SurfaceShell& shell);
  void share_planes(std::span<const std::uint32_t> face, std::uint32_t first);
  void add_backs(std::span<const std::uint32_t> at_pockets, std::uint32_t first);
  double widest_seam() const;
  template <class Visit>
  void near_box(const Vec3& low, const Vec3& high, const Visit& visit) const;
  void find_edges();
  void build_tree();
  void sort_by(std::span<const std::uint32_t> order);
  /// Of the corners about the centre, and of the normals.
  struct Extent {
    Vec3 low{HUGE_VAL}, high{-HUGE_VAL};  ///< m
    Vec3 least_normal{HUGE_VAL}, most_normal{-HUGE_VAL};
    void add(const Extent& other);
  };
  Extent extent_of(std::uint32_t triangle) const;
  std::uint32_t build_node(std::uint32_t begin, std::uint32_t end, std::uint32_t& used,
                           Extent& extent);
  void set_child(Node& node, std::size_t child, const Extent& extent, std::uint32_t from,
                 std::uint32_t to, std::uint32_t first, std::uint32_t last) const;

  LargeArray<Vec3> vertices_;
  LargeArray<SurfaceTriangle> triangles_;
  std::vector<Material> materials_;
  std::vector<std::uint32_t> file_order_;
  double coordinate_error_ = 0;  ///< m, of the worst shell
  double seam_ = 0;
  LargeArray<Node> nodes_;
  std::uint32_t root_ = 0;
  Vec3 centre_;
  double radius_ = 0;
};

}  // namespace palpate::stimuli
