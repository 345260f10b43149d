#pragma once
// A closed surface as other bodies meet it: its corners, convex edges and faces, each with the
// directions in which it can be the first to touch, in trees. Frame of the body, m.

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/surfaces/surface.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Unit directions within an angle of an axis.
struct DirectionCone {
  Vec3 axis{0, 0, 1};
  double cosine = -1, sine = 0;  ///< of the angle, at most pi

  static DirectionCone around(std::span<const Vec3> directions);
  static DirectionCone around(const DirectionCone& a, const DirectionCone& b);
  /// Whether some direction of this cone may be opposite to one of the other.
  /// \param other_axis  its axis in the frame of this one
  /// \param turn  rad, small; the angle by which they may miss each other
  bool may_oppose(const DirectionCone& other, const Vec3& other_axis, double turn) const;
};

/// A tree of boxes over features. Each box has the cone of all directions of its features.
class FeatureTree {
 public:
  struct Node {
    Vec3 middle, half;  ///< of the box
    DirectionCone cone;
    std::uint32_t first = 0;  ///< of a leaf: item; else the node of the second child
    std::uint32_t count = 0;  ///< of a leaf: items; else 0. The first child is the next node
  };
  struct Item {
    Vec3 low, high;
    DirectionCone cone;
    std::uint32_t feature = 0;
  };

  FeatureTree() = default;
  explicit FeatureTree(std::vector<Item> items);
  bool empty() const { return nodes_.empty(); }
  const Node& node(std::uint32_t index) const { return nodes_[index]; }
  std::uint32_t feature(std::uint32_t item) const { return features_[item]; }

 private:
  std::uint32_t build(std::span<Item> items);
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> features_;
};

/// Immutable.
class CollisionSurface {
 public:
  /// Triangles, counter-clockwise seen from outside; equal corners have equal numbers. Overlapping
  /// closed shells collide each by themselves.
  CollisionSurface(std::vector<Vec3> vertices,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles);
  /// \param pose  of its frame in that of the body
  CollisionSurface(const Surface& surface, const Pose& pose);

  struct Face {
    std::array<std::uint32_t, 3> corners{};
    std::array<std::uint32_t, 3> across{};  ///< faces beyond the sides; kNone: not one face
    std::array<Vec3, 3> inward;             ///< unit, in the plane, from side k
    std::array<double, 3> side{};           ///< m; side k is where dot(inward, p) == side
    Vec3 normal;                            ///< unit, outward
    double offset = 0;                      ///< m
  };
  /// A convex one.
  struct Edge {
    std::array<std::uint32_t, 2> ends{};
    std::array<std::uint32_t, 2> beside{};  ///< third corners of its two faces
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Face>& faces() const { return faces_; }
  const std::vector<Edge>& edges() const { return edges_; }
  const FeatureTree& corner_tree() const { return corner_tree_; }  ///< convex vertices
  const FeatureTree& edge_tree() const { return edge_tree_; }
  const FeatureTree& face_tree() const { return face_tree_; }
  /// The face that reports contacts of a vertex: one of those around it.
  std::uint32_t face_of(std::uint32_t vertex) const { return face_of_[vertex]; }
  bool is_corner(std::uint32_t vertex) const { return is_corner_[vertex] != 0; }

  /// Whether no neighbour of the vertex lies farther along a direction.
  /// \param tolerance  rad
  bool is_extreme(std::uint32_t vertex, const Vec3& direction, double tolerance) const;
  bool is_extreme(const Edge& edge, const Vec3& direction, double tolerance) const;

  /// m, from a point to the nearest place of the surface.
  double distance(const Vec3& point) const;
  bool contains(const Vec3& point) const;
  /// Calls visit(t, face) for each crossing of a segment from `start`, 0 < t < 1.
  template <class Visit>
  void crossings(const Vec3& start, const Vec3& along, const Visit& visit) const;

 private:
  void make_faces(const std::vector<std::array<std::uint32_t, 3>>& triangles);
  void find_neighbours();
  std::vector<FeatureTree::Item> find_edges();
  std::vector<FeatureTree::Item> find_corners();
  bool directions_at(std::uint32_t vertex, DirectionCone& cone) const;

  std::vector<Vec3> vertices_;
  std::vector<Face> faces_;
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> first_neighbour_, neighbours_;  ///< of each vertex
  std::vector<std::uint32_t> first_face_, faces_at_;         ///< of each vertex
  std::vector<std::uint32_t> face_of_;
  std::vector<char> is_corner_;
  std::vector<DirectionCone> corner_cones_, face_cones_;
  FeatureTree corner_tree_, edge_tree_, face_tree_;
};

template <class Visit>
void CollisionSurface::crossings(const Vec3& start, const Vec3& along, const Visit& visit) const {
  std::array<std::uint32_t, 64> stack;
  std::size_t depth = 0;
  if (!face_tree_.empty()) stack[depth++] = 0;
  const Vec3 middle = start + 0.5 * along;
  const Vec3 half = 0.5 * Vec3(std::abs(along.x), std::abs(along.y), std::abs(along.z));
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    const FeatureTree::Node& node = face_tree_.node(index);
    const Vec3 apart = node.middle - middle, both = node.half + half;
    if (std::abs(apart.x) > both.x || std::abs(apart.y) > both.y || std::abs(apart.z) > both.z)
      continue;
    // The segment against the box: axes at right angles to it and to one side of the box.
    const Vec3 across = glm::cross(along, apart);
    const Vec3 size(std::abs(along.x), std::abs(along.y), std::abs(along.z));
    constexpr double kRounding = 1 + 1e-9;
    if (std::abs(across.x) > kRounding * (size.z * node.half.y + size.y * node.half.z) + 1e-300 ||
        std::abs(across.y) > kRounding * (size.z * node.half.x + size.x * node.half.z) + 1e-300 ||
        std::abs(across.z) > kRounding * (size.y * node.half.x + size.x * node.half.y) + 1e-300)
      continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = index + 1;
      continue;
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      const std::uint32_t f = face_tree_.feature(k);
      const Face& face = faces_[f];
      const double speed = glm::dot(face.normal, along);
      if (speed == 0) continue;
      const double t = (face.offset - glm::dot(face.normal, start)) / speed;
      if (!(t > 0 && t < 1)) continue;
      const Vec3 place = start + t * along;
      bool inside = true;
      for (std::size_t s = 0; s < 3; ++s) inside &= glm::dot(face.inward[s], place) >= face.side[s];
      if (inside) visit(t, f);
    }
  }
}

}  // namespace palpate::stimuli
