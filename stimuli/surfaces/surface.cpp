#include "stimuli/surfaces/surface.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "stimuli/surfaces/surface_search.h"

namespace palpate::stimuli {
namespace {

/// Six times the signed volume below d's plane, in doubles, and a bound of its rounding error
/// (Shewchuk 1997, orient3d's filter).
struct Volume {
  double value, bound;
};

Volume signed_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 p = a - d, q = b - d, r = c - d;
  const double x = p.y * q.z - p.z * q.y, y = p.z * q.x - p.x * q.z, z = p.x * q.y - p.y * q.x;
  const double value = r.x * x + r.y * y + r.z * z;
  const double most = std::abs(r.x) * (std::abs(p.y * q.z) + std::abs(p.z * q.y)) +
                      std::abs(r.y) * (std::abs(p.z * q.x) + std::abs(p.x * q.z)) +
                      std::abs(r.z) * (std::abs(p.x * q.y) + std::abs(p.y * q.x));
  return {value, 8 * std::numeric_limits<double>::epsilon() * most};
}

constexpr double kSliver = 1e-6;  // height of the length
// A lower triangle has no area, only rounding.
constexpr double kRoundings = 8 * std::numeric_limits<double>::epsilon();

/// Whether rounding of the normals may be larger than the bend of an edge. A segment along the two
/// triangles may then see them as those of a convex edge, although its corners make it concave.
bool is_flat(const Vec3& left, const Vec3& right) {
  constexpr double kUnbent = 1e-9;  // rad
  const Vec3 bend = left - right;
  return glm::dot(bend, bend) <= kUnbent * kUnbent;
}

float rounded_up(double value) {
  const auto near = static_cast<float>(value);
  return static_cast<double>(near) < value
             ? std::nextafter(near, std::numeric_limits<float>::infinity())
             : near;
}

/// The normal for a triangle without area: that of the neighbour over its longest side, along which
/// it lies. If that one has no area either, its neighbours are asked in the same way.
Vec3 normal_of_neighbours(std::uint32_t index, const LargeArray<Vec3>& vertices,
                          const LargeArray<SurfaceTriangle>& triangles) {
  constexpr int kMostSteps = 1000;
  std::uint32_t entered = 3;  // side; not taken back: two such triangles may lie along each other
  for (int step = 0; step < kMostSteps; ++step) {
    const SurfaceTriangle& t = triangles[index];
    if (t.normal != Vec3(0)) return t.normal;
    std::uint32_t longest = 0;
    double most = -1;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const double length = glm::distance(vertices[t.corners[k]], vertices[t.corners[(k + 1) % 3]]);
      if (k == entered || !(length > most)) continue;
      longest = k;
      most = length;
    }
    index = SurfaceTriangle::triangle_of(t.across[longest]);
    entered = SurfaceTriangle::side_of(t.across[longest]);
  }
  return {0, 0, 1};
}

/// A triangle on its way to its place.
struct Placed {
  Vec3 middle;
  std::uint32_t triangle;
};

/// Moves the `first` triangles along the longest extent of the middles to the front.
void split(std::span<Placed> triangles, std::size_t first) {
  Vec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const Placed& one : triangles) {
    low = glm::min(low, one.middle);
    high = glm::max(high, one.middle);
  }
  const Vec3 extent = high - low;
  int axis = 0;
  if (extent[1] > extent[axis]) axis = 1;
  if (extent[2] > extent[axis]) axis = 2;
  std::nth_element(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(first),
                   triangles.end(), [axis](const Placed& p, const Placed& q) {
                     return p.middle[axis] != q.middle[axis] ? p.middle[axis] < q.middle[axis]
                                                             : p.triangle < q.triangle;
                   });
}

/// Halves a node's triangles until each of its children has its share.
/// \param halve  called with the range of triangles and how many of them the first half gets
template <class Halve, class Visit>
void for_each_child(std::uint32_t begin, std::uint32_t end, const Halve& halve,
                    const Visit& visit) {
  std::uint32_t share = 1;
  while (std::size_t{share} * Surface::kWidth < end - begin)
    share *= static_cast<std::uint32_t>(Surface::kWidth);
  const auto divide = [&](const auto& self, std::uint32_t from, std::uint32_t to) -> void {
    if (to - from <= share) return visit(from, to);
    const std::uint32_t half = (to - from + share) / (2 * share) * share;
    halve(from, to, half);
    self(self, from, from + half);
    self(self, from + half, to);
  };
  divide(divide, begin, end);
}

/// Sorts triangles so that each node's are side by side, before there is any node.
void sort_for_nodes(std::span<Placed> triangles) {
  for_each_child(
      0, static_cast<std::uint32_t>(triangles.size()),
      [&](std::uint32_t from, std::uint32_t to, std::uint32_t first) {
        split(triangles.subspan(from, to - from), first);
      },
      [&](std::uint32_t from, std::uint32_t to) {
        if (to - from > 1) sort_for_nodes(triangles.subspan(from, to - from));
      });
}

/// Moves each element to its place, without a copy of the array.
template <class T>
void move_to(LargeArray<T>& all, std::span<const std::uint32_t> place) {
  std::vector<bool> there(all.size(), false);
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    for (std::uint32_t to = place[i]; !there[i]; to = place[to]) {
      std::swap(all[i], all[to]);  // round the cycle, by way of i
      there[to] = true;
    }
  }
}

}  // namespace

Surface::Surface(std::span<const SurfaceShell> shells) {
  std::size_t vertices = 0, triangles = 0;
  for (const SurfaceShell& shell : shells) {
    vertices += shell.surface->vertices.size();
    triangles += shell.surface->triangles.size() + shell.surface->at_pockets.size();
  }
  vertices_.reserve(vertices);
  triangles_.reserve(triangles);
  for (const SurfaceShell& shell : shells) add(shell);
  Vec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const Vec3& v : vertices_) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  if (vertices_.empty()) return;
  centre_ = 0.5 * (low + high);
  for (const Vec3& v : vertices_) radius_ = std::max(radius_, glm::length(v - centre_));
  radius_ *= 1 + 1e-15;
  find_edges();
  build_tree();
  seam_ = widest_seam();
}

void Surface::add(const SurfaceShell& shell) {
  const auto first = static_cast<std::uint32_t>(vertices_.size());
  const auto base = static_cast<std::uint32_t>(triangles_.size());
  const bool placed = shell.pose.orientation != Quat(1, 0, 0, 0) || shell.pose.position != Vec3(0);
  for (const Vec3& v : shell.surface->vertices)
    vertices_.push_back(placed ? shell.pose.orientation * v + shell.pose.position : v);
  const auto& corners = shell.surface->triangles;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    SurfaceTriangle& t = triangles_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) t.corners[k] = first + corners[i][k];
    t.shell = static_cast<std::uint32_t>(materials_.size());
    const Vec3 &a = vertices_[t.corners[0]], &b = vertices_[t.corners[1]],
               &c = vertices_[t.corners[2]];
    // From the two longest sides: for needles that rounds least.
    const Vec3 ab = b - a, bc = c - b, ca = a - c;
    const double ab2 = glm::dot(ab, ab), bc2 = glm::dot(bc, bc), ca2 = glm::dot(ca, ca);
    Vec3 normal = ab2 >= bc2 && ab2 >= ca2 ? (bc2 > ca2 ? glm::cross(ab, bc) : glm::cross(ca, ab))
                  : bc2 >= ca2             ? (ab2 > ca2 ? glm::cross(ab, bc) : glm::cross(bc, ca))
                                           : (ab2 > bc2 ? glm::cross(ca, ab) : glm::cross(bc, ca));
    // Rounding tilts a sliver's normal along its length, where it matters most.
    const Vec3& longest = ab2 >= bc2 && ab2 >= ca2 ? ab : bc2 >= ca2 ? bc : ca;
    const double longest2 = glm::dot(longest, longest), reach = std::sqrt(longest2);
    if (glm::dot(normal, normal) < kSliver * kSliver * longest2 * longest2)
      normal -= glm::dot(normal, longest) / longest2 * longest;
    const double length = glm::length(normal);
    const bool has_area = length > kRoundings * (reach + glm::length(a)) * reach;
    t.normal = has_area ? normal / length : Vec3(0);
    t.offset = glm::dot(t.normal, a);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t beyond = shell.surface->across[i][k];
      const std::uint32_t end = corners[i][(k + 1) % 3];
      std::uint32_t side = 0;
      while (side < 2 &&
             !(corners[beyond][side] == end && corners[beyond][(side + 1) % 3] == corners[i][k]))
        ++side;
      t.across[k] = (base + beyond) << 2 | side;
    }
  }
  materials_.push_back(shell.material);
  coordinate_error_ =
      std::max(coordinate_error_, shell.surface->coordinate_error + shell.pose_error);
  share_planes(shell.surface->flat_face, base);
  for (std::uint32_t i = base; i < triangles_.size(); ++i) {
    SurfaceTriangle& t = triangles_[i];
    if (t.normal != Vec3(0)) continue;
    t.normal = normal_of_neighbours(i, vertices_, triangles_);
    t.offset = glm::dot(t.normal, vertices_[t.corners[0]]);
  }
  add_backs(shell.surface->at_pockets, base);
}

/// Gives all triangles of a large plane face one plane, to the bit: no segment touches the edges
/// between them, into however many slivers the face is cut. None of its corners is below it: a tool
/// that came in between a higher plane and its outline would not meet it. Faces whose file rounds
/// their corners to somewhere near a plane keep a plane for each triangle.
/// \param face  of each triangle of a shell \param first  triangle of the shell
void Surface::share_planes(std::span<const std::uint32_t> face, std::uint32_t first) {
  constexpr double kEven = 1e-12;  // of the distance from the origin; rounding of doubles
  struct Plane {
    Vec3 areas{0}, normal{0};
    double highest = -HUGE_VAL, lowest = HUGE_VAL, reach = 0;
  };
  std::vector<Plane> planes;
  const auto for_each = [&](const auto& visit) {
    for (std::size_t i = 0; i < face.size(); ++i) {
      if (face[i] == kNoFlatFace) continue;
      if (face[i] >= planes.size()) planes.resize(face[i] + 1);
      visit(planes[face[i]], triangles_[first + i]);
    }
  };
  for_each([&](Plane& plane, const SurfaceTriangle& t) {
    const Vec3& a = vertices_[t.corners[0]];
    plane.areas += glm::cross(vertices_[t.corners[1]] - a, vertices_[t.corners[2]] - a);
  });
  for (Plane& plane : planes) plane.normal = glm::normalize(plane.areas);
  for_each([&](Plane& plane, const SurfaceTriangle& t) {
    for (const std::uint32_t corner : t.corners) {
      const double height = glm::dot(plane.normal, vertices_[corner]);
      plane.highest = std::max(plane.highest, height);
      plane.lowest = std::min(plane.lowest, height);
      plane.reach = std::max(plane.reach, glm::length(vertices_[corner]));
    }
  });
  for_each([&](const Plane& plane, SurfaceTriangle& t) {
    if (plane.highest - plane.lowest > kEven * plane.reach) return;
    t.normal = plane.normal;
    t.offset = plane.lowest;
    t.touched |= SurfaceTriangle::kSharesPlane;
  });
}

/// Adds the reverse of each triangle that may bound a pocket. Between the two no tool gets into it,
/// as if it were solid. Where they bound solid, the reverse is seen from inside only.
/// \param first  of the shell's triangles
void Surface::add_backs(std::span<const std::uint32_t> at_pockets, std::uint32_t first) {
  const auto back = static_cast<std::uint32_t>(triangles_.size());
  for (const std::uint32_t i : at_pockets) {
    SurfaceTriangle t = triangles_[first + i];
    std::swap(t.corners[1], t.corners[2]);
    t.normal = -t.normal;
    t.offset = -t.offset;
    t.touched |= SurfaceTriangle::kBack;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t across = triangles_[first + i].across[2 - k];
      const auto beyond =
          std::ranges::lower_bound(at_pockets, SurfaceTriangle::triangle_of(across) - first);
      if (beyond != at_pockets.end() && *beyond == SurfaceTriangle::triangle_of(across) - first) {
        t.across[k] = (back + static_cast<std::uint32_t>(beyond - at_pockets.begin())) << 2 |
                      (2 - SurfaceTriangle::side_of(across));
      } else {
        t.across[k] = (first + i) << 2 | (2 - k);
        t.touched |= 1U << (6 + k);
      }
    }
    triangles_.push_back(t);
  }
}

void Surface::find_edges() {
  for (SurfaceTriangle& t : triangles_) {
    const Vec3 &a = vertices_[t.corners[0]], &b = vertices_[t.corners[1]],
               &c = vertices_[t.corners[2]];
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (t.ends(k)) continue;
      const SurfaceTriangle& other = triangles_[SurfaceTriangle::triangle_of(t.across[k])];
      const std::uint32_t apex = other.corners[(SurfaceTriangle::side_of(t.across[k]) + 2) % 3];
      // Positive if the neighbour's far corner is below this triangle's plane.
      const Volume under = signed_volume(a, b, c, vertices_[apex]);
      if (!(under.value < -under.bound)) t.touched |= 1U << k;
    }
  }
  // Both triangles of an edge must agree.
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (triangles_[i].ends(k)) continue;
      const std::uint32_t across = triangles_[i].across[k];
      SurfaceTriangle& other = triangles_[SurfaceTriangle::triangle_of(across)];
      const std::uint32_t side = SurfaceTriangle::side_of(across);
      if (triangles_[i].shares_plane() && triangles_[i].normal == other.normal &&
          triangles_[i].offset == other.offset) {
        triangles_[i].touched &= ~(1U << k);  // never a silhouette
        other.touched &= ~(1U << side);
      } else if (triangles_[i].touches(k) || other.touches(side) ||
                 is_flat(triangles_[i].normal, other.normal)) {
        triangles_[i].touched |= 1U << k;
        other.touched |= 1U << side;
      }
      // Rounding folds slivers over a ridge, so that each of its edges seems to be concave. There
      // patches face as those of convex edges; in a groove they are buried.
      if (!triangles_[i].touches(k) && glm::dot(triangles_[i].normal, other.normal) < 0) {
        triangles_[i].touched |= 9U << k;
        other.touched |= 9U << side;
      }
      if (across > (i << 2 | k)) triangles_[i].owned |= 1U << k;
    }
  }
}

void Surface::build_tree() {
  std::vector<std::uint32_t> order(triangles_.size());
  {
    std::vector<Placed> placed(triangles_.size());
    for (std::uint32_t i = 0; i < placed.size(); ++i) {
      const auto& c = triangles_[i].corners;
      placed[i] = {(vertices_[c[0]] + vertices_[c[1]] + vertices_[c[2]]) / 3.0, i};
    }
    sort_for_nodes(placed);
    for (std::size_t i = 0; i < placed.size(); ++i) order[i] = placed[i].triangle;
  }
  sort_by(order);
  order = {};
  nodes_.reserve(triangles_.size() / (kWidth - 1) + 16);
  Extent all;
  std::uint32_t used = 0;
  // A few places of nodes_ stay unused: to give them back would copy all.
  root_ = build_node(0, static_cast<std::uint32_t>(triangles_.size()), used, all);
}

/// Sorts triangles and vertices as the tree has them: what is near in space is near in memory.
void Surface::sort_by(std::span<const std::uint32_t> order) {
  std::vector<std::uint32_t>& place = file_order_;
  place.resize(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> vertex_place(vertices_.size(), kNone);
  std::uint32_t used = 0;
  for (const std::uint32_t from : order) {
    SurfaceTriangle& t = triangles_[from];
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& corner = vertex_place[t.corners[k]];
      if (corner == kNone) corner = used++;
      t.corners[k] = corner;
      t.across[k] = place[SurfaceTriangle::triangle_of(t.across[k])] << 2 |
                    SurfaceTriangle::side_of(t.across[k]);
    }
  }
  for (std::uint32_t& corner : vertex_place) {
    if (corner == kNone) corner = used++;  // of no triangle: to the end
  }
  move_to(triangles_, place);
  move_to(vertices_, vertex_place);
  std::erase_if(file_order_, [&](std::uint32_t i) { return triangles_[i].is_back(); });
}

/// All nodes are full, except for the last of each level.
/// \param used  vertices of the triangles before `begin`, then before `end`; a subtree's others are
/// shared with earlier ones \param extent  of all its triangles
std::uint32_t Surface::build_node(std::uint32_t begin, std::uint32_t end, std::uint32_t& used,
                                  Extent& extent) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  Node node;
  for (std::size_t k = 0; k < 3; ++k) {
    node.low[k] = Lanes{} + std::numeric_limits<float>::infinity();
    node.high[k] = -node.low[k];
  }
  const bool leaf = end - begin <= kWidth;
  nodes_.push_back(node);
  std::size_t child = 0;
  for_each_child(
      begin, end, [](std::uint32_t, std::uint32_t, std::uint32_t) {},
      [&](std::uint32_t from, std::uint32_t to) {
        const std::uint32_t first = used;
        Extent own;
        if (leaf) {
          node.children[child] = from;
          own.add(extent_of(from));
          for (const std::uint32_t corner : triangles_[from].corners)
            used = std::max(used, corner + 1);
        } else {
          node.children[child] = build_node(from, to, used, own);
        }
        set_child(node, child++, own, from, to, first, used);
        extent.add(own);
      });
  nodes_[index] = node;
  return index << 1 | (leaf ? 1U : 0U);
}

/// Of a triangle, with the normals of its neighbours across touched edges.
Surface::Extent Surface::extent_of(std::uint32_t triangle) const {
  const SurfaceTriangle& t = triangles_[triangle];
  Extent out;
  for (const std::uint32_t corner : t.corners) {
    out.low = glm::min(out.low, vertices_[corner] - centre_);
    out.high = glm::max(out.high, vertices_[corner] - centre_);
  }
  out.least_normal = out.most_normal = t.normal;
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (!t.owns(k) || !t.touches(k)) continue;
    const Vec3& normal = triangles_[SurfaceTriangle::triangle_of(t.across[k])].normal;
    out.least_normal = glm::min(out.least_normal, normal);
    out.most_normal = glm::max(out.most_normal, normal);
  }
  return out;
}

void Surface::Extent::add(const Extent& other) {
  low = glm::min(low, other.low);
  high = glm::max(high, other.high);
  least_normal = glm::min(least_normal, other.least_normal);
  most_normal = glm::max(most_normal, other.most_normal);
}

/// \param from, to  its triangles \param first, last  vertices that occur in these for the first
/// time
void Surface::set_child(Node& node, std::size_t child, const Extent& extent, std::uint32_t from,
                        std::uint32_t to, std::uint32_t first, std::uint32_t last) const {
  Vec3 middle;
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    node.low[axis][child] = -rounded_up(-extent.low[k]);
    node.high[axis][child] = rounded_up(extent.high[k]);
    const auto rounded = static_cast<float>(0.5 * (extent.least_normal[k] + extent.most_normal[k]));
    node.middle[axis][child] = rounded;
    middle[k] = rounded;
  }
  double top = -HUGE_VAL;
  for (std::uint32_t v = first; v < last; ++v)
    top = std::max(top, glm::dot(middle, vertices_[v] - centre_));
  for (std::uint32_t i = from; i < to; ++i) {
    for (const std::uint32_t corner : triangles_[i].corners) {
      if (corner < first) top = std::max(top, glm::dot(middle, vertices_[corner] - centre_));
    }
  }
  node.top[child] = rounded_up(top);
  node.radius[child] =
      rounded_up(0.5 * glm::length(extent.most_normal - extent.least_normal) + 1e-6);
}

int Surface::winding(const Vec3& point) const {
  // Count crossings of a ray. Try odd directions until no crossing is within rounding of a side.
  constexpr int kDirections = 8;
  int count = 0;
  for (int n = 0; n < kDirections; ++n) {
    const double turn = 0.7 + 2.399963229728653 * n, rise = 0.33 - 0.0817 * n;
    const double flat = std::sqrt(1 - rise * rise);
    const Vec3 way = (4 * radius_ + glm::length(point - centre_)) *
                     Vec3(flat * std::cos(turn), flat * std::sin(turn), rise);
    count = 0;
    bool clear = true;
    near_segment(point, way, [&](std::uint32_t index) {
      const SurfaceTriangle& t = triangles_[index];
      if (t.is_back()) return true;
      const Vec3 a = vertices_[t.corners[0]] - point, b = vertices_[t.corners[1]] - point,
                 c = vertices_[t.corners[2]] - point;
      const double sides[3] = {glm::dot(way, glm::cross(a, b)), glm::dot(way, glm::cross(b, c)),
                               glm::dot(way, glm::cross(c, a))};
      const bool in = sides[0] <= 0 && sides[1] <= 0 && sides[2] <= 0;
      const bool out = sides[0] >= 0 && sides[1] >= 0 && sides[2] >= 0;
      if (!in && !out) return true;
      if (sides[0] == 0 || sides[1] == 0 || sides[2] == 0) {
        clear = false;
        return false;
      }
      const double height = glm::dot(t.normal, a);  // of the plane over the point
      if (out && height > 0) ++count;
      if (in && height < 0) --count;
      return true;
    });
    if (clear) break;
  }
  return count;
}

}  // namespace palpate::stimuli
