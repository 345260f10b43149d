#include "stimuli/surfaces/collision_surface.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <tuple>
#include <utility>

#include "stimuli/nearest_on_triangle.h"

namespace palpate::stimuli {
namespace {

constexpr double kFlat = 1e-9;          // rad; a smaller bend is rounding
constexpr std::size_t kInLeaf = 4;      // features
constexpr std::size_t kManyEdges = 24;  // of a vertex that is not convex

DirectionCone everywhere() { return {}; }
const DirectionCone kNoDirections{Vec3(0, 0, 1), 2, 0};

DirectionCone cone_of(const Vec3& axis, double cosine) {
  const double c = std::clamp(cosine, -1.0, 1.0);
  return {axis, c, std::sqrt(std::max(0.0, 1 - c * c))};
}

/// Whether unit vectors span a solid angle.
bool span_space(std::span<const Vec3> rays) {
  constexpr double kLeast = 1e-6;  // rad
  if (rays.size() < 3) return false;
  const Vec3& first = rays.front();
  Vec3 other(0);
  for (const Vec3& ray : rays) {
    const Vec3 cross = glm::cross(first, ray);
    if (glm::dot(cross, cross) > glm::dot(other, other)) other = cross;
  }
  const double length = glm::length(other);
  if (!(length > kLeast)) return false;
  return std::ranges::any_of(
      rays, [&](const Vec3& ray) { return std::abs(glm::dot(ray, other)) > kLeast * length; });
}

Vec3 unit_or_zero(const Vec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : Vec3(0);
}

}  // namespace

DirectionCone DirectionCone::around(std::span<const Vec3> directions) {
  Vec3 sum(0);
  for (const Vec3& direction : directions) sum += direction;
  const double length = glm::length(sum);
  if (!(length > 1e-6)) return everywhere();
  const Vec3 axis = sum / length;
  double cosine = 1;
  for (const Vec3& direction : directions) cosine = std::min(cosine, glm::dot(axis, direction));
  return cone_of(axis, cosine);
}

DirectionCone DirectionCone::around(const DirectionCone& a, const DirectionCone& b) {
  const double angle_a = std::atan2(a.sine, a.cosine), angle_b = std::atan2(b.sine, b.cosine);
  const double between = std::acos(std::clamp(glm::dot(a.axis, b.axis), -1.0, 1.0));
  if (between + angle_b <= angle_a) return a;
  if (between + angle_a <= angle_b) return b;
  const double angle = 0.5 * (between + angle_a + angle_b);
  if (!(angle < 3.1)) return everywhere();
  // The axis turned from a towards b.
  const double turn = angle - angle_a;
  const Vec3 across = b.axis - glm::dot(a.axis, b.axis) * a.axis;
  const double length = glm::length(across);
  if (!(length > 1e-9)) return between < 1 ? cone_of(a.axis, std::cos(angle + 1e-6)) : everywhere();
  const Vec3 axis = glm::normalize(std::cos(turn) * a.axis + std::sin(turn) / length * across);
  return cone_of(axis, std::cos(std::min(angle + 1e-9, 3.1)));
}

bool DirectionCone::may_oppose(const DirectionCone& other, const Vec3& other_axis,
                               double turn) const {
  constexpr double kRounding = 1e-6;
  // The angles' sum is at least pi.
  if (sine * other.cosine + cosine * other.sine <= 0 && (cosine < 0 || other.cosine < 0))
    return true;
  return -glm::dot(axis, other_axis) >=
         cosine * other.cosine - sine * other.sine - turn - kRounding;
}

FeatureTree::FeatureTree(std::vector<Item> items) {
  if (items.empty()) return;
  nodes_.reserve(2 * items.size() / kInLeaf + 2);
  features_.reserve(items.size());
  build(items);
}

std::uint32_t FeatureTree::build(std::span<Item> items) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (const Item& item : items) {
    low = glm::min(low, item.low);
    high = glm::max(high, item.high);
  }
  const Vec3 middle = 0.5 * (low + high);
  DirectionCone cone;
  if (items.size() <= kInLeaf) {
    cone = items.front().cone;
    nodes_[index].first = static_cast<std::uint32_t>(features_.size());
    nodes_[index].count = static_cast<std::uint32_t>(items.size());
    for (const Item& item : items) {
      cone = DirectionCone::around(cone, item.cone);
      features_.push_back(item.feature);
    }
  } else {
    const Vec3 size = high - low;
    const glm::length_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto half = items.begin() + static_cast<std::ptrdiff_t>(items.size() / 2);
    std::nth_element(items.begin(), half, items.end(), [axis](const Item& a, const Item& b) {
      return a.low[axis] + a.high[axis] < b.low[axis] + b.high[axis];
    });
    const auto first = build(items.first(items.size() / 2));
    const auto second = build(items.subspan(items.size() / 2));
    nodes_[index].first = second;
    cone = DirectionCone::around(nodes_[first].cone, nodes_[second].cone);
  }
  nodes_[index].middle = middle;
  nodes_[index].half = glm::max(high - middle, middle - low);
  nodes_[index].cone = cone;
  return index;
}

CollisionSurface::CollisionSurface(std::vector<Vec3> vertices,
                                   const std::vector<std::array<std::uint32_t, 3>>& triangles)
    : vertices_(std::move(vertices)) {
  make_faces(triangles);
  find_neighbours();
  std::vector<FeatureTree::Item> edges = find_edges();
  std::vector<FeatureTree::Item> corners = find_corners();
  std::vector<FeatureTree::Item> faces(faces_.size());
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    FeatureTree::Item& item = faces[f];
    const Face& face = faces_[f];
    item.feature = f;
    item.low = item.high = vertices_[face.corners[0]];
    item.cone = face_cones_[f];
    for (const std::uint32_t v : face.corners) {
      item.low = glm::min(item.low, vertices_[v]);
      item.high = glm::max(item.high, vertices_[v]);
      if (corner_cones_[v].cosine < kNoDirections.cosine)
        item.cone = DirectionCone::around(item.cone, corner_cones_[v]);
    }
  }
  edge_tree_ = FeatureTree(std::move(edges));
  corner_tree_ = FeatureTree(std::move(corners));
  face_tree_ = FeatureTree(std::move(faces));
  corner_cones_ = {};
  face_cones_ = {};
}

CollisionSurface::CollisionSurface(const Surface& surface, const Pose& pose)
    : CollisionSurface(
          [&] {
            std::vector<Vec3> vertices;
            vertices.reserve(surface.vertices().size());
            for (const Vec3& v : surface.vertices())
              vertices.push_back(pose.orientation * v + pose.position);
            return vertices;
          }(),
          [&] {
            std::vector<std::array<std::uint32_t, 3>> triangles;
            triangles.reserve(surface.triangles().size());
            for (const SurfaceTriangle& triangle : surface.triangles()) {
              if (!triangle.is_back()) triangles.push_back(triangle.corners);
            }
            return triangles;
          }()) {}

/// Leaves out faces without area.
void CollisionSurface::make_faces(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  faces_.reserve(triangles.size());
  for (const auto& corners : triangles) {
    Face face;
    face.corners = corners;
    const Vec3 &a = vertices_[corners[0]], &b = vertices_[corners[1]], &c = vertices_[corners[2]];
    face.normal = unit_or_zero(glm::cross(b - a, c - a));
    if (face.normal == Vec3(0)) continue;
    face.offset = glm::dot(face.normal, (a + b + c) / 3.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &from = vertices_[corners[k]], &to = vertices_[corners[(k + 1) % 3]];
      face.inward[k] = unit_or_zero(glm::cross(face.normal, to - from));
      face.side[k] = glm::dot(face.inward[k], 0.5 * (from + to));
    }
    face.across = {kNone, kNone, kNone};
    faces_.push_back(face);
  }
}

/// Sets across, the neighbours and faces of each vertex.
void CollisionSurface::find_neighbours() {
  struct Side {
    std::uint32_t low, high, face, side;
  };
  std::vector<Side> sides;
  sides.reserve(3 * faces_.size());
  face_of_.assign(vertices_.size(), kNone);
  first_face_.assign(vertices_.size() + 1, 0);
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t from = faces_[f].corners[k], to = faces_[f].corners[(k + 1) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), f, k});
      face_of_[from] = std::min(face_of_[from], f);
      ++first_face_[from + 1];
    }
  }
  for (std::size_t v = 0; v < vertices_.size(); ++v) first_face_[v + 1] += first_face_[v];
  faces_at_.resize(sides.size());
  std::vector<std::uint32_t> next(first_face_.begin(), first_face_.end() - 1);
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (const std::uint32_t v : faces_[f].corners) faces_at_[next[v]++] = f;
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  first_neighbour_.assign(vertices_.size() + 1, 0);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;
  joined.reserve(sides.size());
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high)
      ++end;
    if (end == i + 2) {
      faces_[sides[i].face].across[sides[i].side] = sides[i + 1].face;
      faces_[sides[i + 1].face].across[sides[i + 1].side] = sides[i].face;
    }
    joined.emplace_back(sides[i].low, sides[i].high);
    joined.emplace_back(sides[i].high, sides[i].low);
    i = end;
  }
  std::sort(joined.begin(), joined.end());
  for (const auto& [vertex, neighbour] : joined) {
    ++first_neighbour_[vertex + 1];
    neighbours_.push_back(neighbour);
  }
  for (std::size_t v = 0; v < vertices_.size(); ++v) first_neighbour_[v + 1] += first_neighbour_[v];
}

/// The convex edges, and the cone of each face with its edges.
std::vector<FeatureTree::Item> CollisionSurface::find_edges() {
  std::vector<FeatureTree::Item> items;
  face_cones_.resize(faces_.size());
  for (std::uint32_t f = 0; f < faces_.size(); ++f) face_cones_[f] = {faces_[f].normal, 1, 0};
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    const Face& face = faces_[f];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t other = face.across[k];
      if (other == kNone || other < f) continue;
      Edge edge;
      edge.ends = {face.corners[k], face.corners[(k + 1) % 3]};
      edge.beside[0] = face.corners[(k + 2) % 3];
      for (const std::uint32_t v : faces_[other].corners) {
        if (v != edge.ends[0] && v != edge.ends[1]) edge.beside[1] = v;
      }
      const Vec3 &from = vertices_[edge.ends[0]], &to = vertices_[edge.ends[1]];
      const Vec3 away = vertices_[edge.beside[1]] - from;
      if (!(glm::dot(face.normal, away) < -kFlat * glm::length(away))) continue;
      const std::array<Vec3, 2> both{face.normal, faces_[other].normal};
      FeatureTree::Item item{glm::min(from, to), glm::max(from, to), DirectionCone::around(both),
                             static_cast<std::uint32_t>(edges_.size())};
      face_cones_[f] = DirectionCone::around(face_cones_[f], item.cone);
      face_cones_[other] = DirectionCone::around(face_cones_[other], item.cone);
      items.push_back(item);
      edges_.push_back(edge);
    }
  }
  return items;
}

/// The directions along which a vertex is farther than its neighbours; unchanged if there are none.
/// \return whether they span a solid angle; false: the vertex lies on a flat place, on a straight
/// edge or in a hollow, and other features touch with it or before it
bool CollisionSurface::directions_at(std::uint32_t vertex, DirectionCone& cone) const {
  std::vector<Vec3> rays;
  bool convex = true;
  for (std::uint32_t k = first_face_[vertex]; k < first_face_[vertex + 1]; ++k) {
    const Face& face = faces_[faces_at_[k]];
    rays.push_back(face.normal);
    for (std::size_t s = 0; s < 3; ++s) {
      if (face.corners[s] != vertex && face.corners[(s + 1) % 3] != vertex) continue;
      if (face.across[s] == kNone) {
        convex = false;
        continue;
      }
      for (const std::uint32_t v : faces_[face.across[s]].corners) {
        const Vec3 away = vertices_[v] - vertices_[face.corners[s]];
        convex &= glm::dot(face.normal, away) <= kFlat * glm::length(away);
      }
    }
  }
  if (convex) {
    cone = DirectionCone::around(rays);
    return span_space(rays);
  }
  std::vector<Vec3> ways;
  for (std::uint32_t k = first_neighbour_[vertex]; k < first_neighbour_[vertex + 1]; ++k)
    ways.push_back(unit_or_zero(vertices_[neighbours_[k]] - vertices_[vertex]));
  if (ways.size() > kManyEdges) {
    cone = everywhere();
    return true;
  }
  rays.clear();
  for (std::size_t i = 0; i < ways.size(); ++i) {
    for (std::size_t k = i + 1; k < ways.size(); ++k) {
      const Vec3 across = unit_or_zero(glm::cross(ways[i], ways[k]));
      for (const Vec3& ray : {across, -across}) {
        if (ray != Vec3(0) &&
            std::ranges::all_of(ways, [&](const Vec3& way) { return glm::dot(way, ray) <= kFlat; }))
          rays.push_back(ray);
      }
    }
  }
  if (rays.empty()) return false;
  cone = DirectionCone::around(rays);
  return span_space(rays);
}

std::vector<FeatureTree::Item> CollisionSurface::find_corners() {
  std::vector<FeatureTree::Item> items;
  is_corner_.assign(vertices_.size(), 0);
  corner_cones_.assign(vertices_.size(), kNoDirections);
  for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
    if (face_of_[v] == kNone) continue;
    DirectionCone& cone = corner_cones_[v];
    is_corner_[v] = directions_at(v, cone) ? 1 : 0;
    if (is_corner(v)) items.push_back({vertices_[v], vertices_[v], cone, v});
  }
  return items;
}

bool CollisionSurface::is_extreme(std::uint32_t vertex, const Vec3& direction,
                                  double tolerance) const {
  for (std::uint32_t k = first_neighbour_[vertex]; k < first_neighbour_[vertex + 1]; ++k) {
    const Vec3 way = vertices_[neighbours_[k]] - vertices_[vertex];
    const double along = glm::dot(way, direction);
    if (along > 0 && along * along > tolerance * tolerance * glm::dot(way, way)) return false;
  }
  return true;
}

bool CollisionSurface::is_extreme(const Edge& edge, const Vec3& direction, double tolerance) const {
  for (const std::uint32_t beside : edge.beside) {
    const Vec3 way = vertices_[beside] - vertices_[edge.ends[0]];
    const double along = glm::dot(way, direction);
    if (along > 0 && along * along > tolerance * tolerance * glm::dot(way, way)) return false;
  }
  return true;
}

double CollisionSurface::distance(const Vec3& point) const {
  std::array<std::uint32_t, 64> stack;
  std::size_t depth = 0;
  double least2 = HUGE_VAL;
  if (!face_tree_.empty()) stack[depth++] = 0;
  const auto distance2 = [&](std::uint32_t index) {
    const FeatureTree::Node& node = face_tree_.node(index);
    const Vec3 out = glm::max(glm::abs(point - node.middle) - node.half, Vec3(0));
    return glm::dot(out, out);
  };
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    if (distance2(index) >= least2) continue;
    const FeatureTree::Node& node = face_tree_.node(index);
    if (node.count == 0) {
      const bool first = distance2(index + 1) <= distance2(node.first);
      stack[depth++] = first ? node.first : index + 1;
      stack[depth++] = first ? index + 1 : node.first;
      continue;
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      const auto& corners = faces_[face_tree_.feature(k)].corners;
      const Vec3 away =
          point - nearest_on_triangle(
                      {vertices_[corners[0]], vertices_[corners[1]], vertices_[corners[2]]}, point);
      least2 = std::min(least2, glm::dot(away, away));
    }
  }
  return std::sqrt(least2);
}

bool CollisionSurface::contains(const Vec3& point) const {
  // Along three directions, as one may pass through an edge.
  constexpr std::array<std::array<double, 3>, 3> kWays = {
      {{0.61, 0.53, 0.589}, {-0.47, 0.71, 0.525}, {0.32, -0.59, -0.741}}};
  if (face_tree_.empty()) return false;
  const FeatureTree::Node& root = face_tree_.node(0);
  if (glm::any(glm::greaterThan(glm::abs(point - root.middle), root.half))) return false;
  int votes = 0;
  for (const auto& way : kWays) {
    int winding = 0;
    const Vec3 along = 4 * glm::length(root.half) * Vec3(way[0], way[1], way[2]);
    crossings(point, along, [&](double, std::uint32_t f) {
      winding += glm::dot(faces_[f].normal, along) > 0 ? 1 : -1;
    });
    votes += winding > 0 ? 1 : 0;
  }
  return votes >= 2;
}

}  // namespace palpate::stimuli
