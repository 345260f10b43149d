#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "stimuli/bounding_tree.h"
#include "stimuli/closed_surface.h"
#include "stimuli/exact_side.h"
#include "stimuli/flat_faces.h"
#include "stimuli/mesh_names.h"
#include "stimuli/nearest_on_triangle.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;

/// A box in single precision, rounded outwards: half the memory.
struct SmallBox {
  std::array<float, 3> low{}, high{};

  SmallBox() = default;
  explicit SmallBox(const Box& box) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      low[i] = static_cast<float>(box.low[k]);
      if (static_cast<double>(low[i]) > box.low[k]) low[i] = std::nextafter(low[i], -kInfinity);
      high[i] = static_cast<float>(box.high[k]);
      if (static_cast<double>(high[i]) < box.high[k]) high[i] = std::nextafter(high[i], kInfinity);
    }
  }
  void add(const SmallBox& box) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], box.low[k]);
      high[k] = std::max(high[k], box.high[k]);
    }
  }
  Vec3 lowest() const { return {low[0], low[1], low[2]}; }
  Vec3 highest() const { return {high[0], high[1], high[2]}; }
  float extent() const { return high[0] - low[0] + (high[1] - low[1]) + (high[2] - low[2]); }  // m
  bool meets(const SmallBox& box) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (low[k] > box.high[k] || box.low[k] > high[k]) return false;
    }
    return true;
  }
};

/// A tree over the triangles, halved between shells, then along a space-filling curve.
class Tree {
 public:
  struct Node {
    SmallBox box;
    Index begin = 0, end = 0;  ///< of `order`
    Index right = 0;           ///< the left child is the next node; 0: a leaf
    Index face = 0;            ///< that all its triangles are part of, or kNoFlatFace
  };

  /// \param shell  of each triangle; all alike: halved along the curve alone
  Tree(const ClosedSurface& surface, const std::vector<Index>& shell)
      : surface_(surface), shell_(shell) {
    Box all;
    for (const Vec3& v : surface.vertices) all.add(v);
    const double size = std::max({all.high.x - all.low.x, all.high.y - all.low.y,
                                  all.high.z - all.low.z, std::numeric_limits<double>::min()});
    std::vector<Key> keys(surface.triangles.size());
    for (Index t = 0; t < keys.size(); ++t) {
      const Triangle& c = surface.triangles[t];
      const Vec3 middle =
          (surface.vertices[c[0]] + surface.vertices[c[1]] + surface.vertices[c[2]]) / 3.0;
      keys[t] = {morton((middle - all.low) / size), t};
    }
    if (std::ranges::all_of(shell, [&](Index one) { return one == shell[0]; })) {
      std::sort(keys.begin(), keys.end());
    } else {
      std::sort(keys.begin(), keys.end(), [&](const Key& a, const Key& b) {
        const Index of_a = shell[a.second], of_b = shell[b.second];
        return of_a != of_b ? of_a < of_b : a < b;
      });
    }
    order_.reserve(keys.size());
    for (const auto& [key, t] : keys) order_.push_back(t);
    nodes_.reserve(keys.size());
    build(keys, 0, static_cast<Index>(keys.size()));
  }

  const std::vector<Node>& nodes() const { return nodes_; }
  static constexpr Index kLeaf = 10;  ///< triangles of a leaf at most
  Index triangle(Index i) const { return order_[i]; }
  Box box(Index t) const {
    Box box;
    for (const Index v : surface_.triangles[t]) box.add(surface_.vertices[v]);
    return box;
  }

  /// The triangles whose boxes meet a box.
  std::vector<Index> meeting(const Box& box) const {
    const SmallBox wanted(box);
    std::vector<Index> found, todo{0};
    while (!todo.empty()) {
      const Index at = todo.back();
      todo.pop_back();
      const Node& node = nodes_[at];
      if (!node.box.meets(wanted)) continue;
      if (node.right != 0) {
        todo.insert(todo.end(), {at + 1, node.right});
        continue;
      }
      for (Index i = node.begin; i < node.end; ++i)
        if (this->box(order_[i]).meets(box)) found.push_back(order_[i]);
    }
    return found;
  }

  /// Whether no shell has triangles of both.
  bool shells_apart(const Node& x, const Node& y) const {
    return last_shell(x) < first_shell(y) || last_shell(y) < first_shell(x);
  }

 private:
  using Key = std::pair<std::uint64_t, Index>;

  Index face_of(Index t) const {
    return surface_.flat_face.empty() ? kNoFlatFace : surface_.flat_face[t];
  }
  Index first_shell(const Node& node) const { return shell_[order_[node.begin]]; }
  Index last_shell(const Node& node) const { return shell_[order_[node.end - 1]]; }

  // Every third bit.
  static std::uint64_t spread(double x) {
    auto bits = static_cast<std::uint64_t>(std::clamp(x, 0.0, 1.0) * 2097151);
    bits = (bits | bits << 32U) & 0x1f00000000ffffU;
    bits = (bits | bits << 16U) & 0x1f0000ff0000ffU;
    bits = (bits | bits << 8U) & 0x100f00f00f00f00fU;
    bits = (bits | bits << 4U) & 0x10c30c30c30c30c3U;
    return (bits | bits << 2U) & 0x1249249249249249U;
  }
  static std::uint64_t morton(const Vec3& at) {
    return spread(at.x) << 2U | spread(at.y) << 1U | spread(at.z);
  }

  void build(const std::vector<Key>& keys, Index begin, Index end) {
    const std::size_t self = nodes_.size();
    nodes_.push_back({{}, begin, end, 0, face_of(order_[begin])});
    if (end - begin <= kLeaf) {
      Box all;
      for (Index i = begin; i < end; ++i) {
        all.add(box(order_[i]));
        if (face_of(order_[i]) != nodes_[self].face) nodes_[self].face = kNoFlatFace;
      }
      nodes_[self].box = SmallBox(all);
      return;
    }
    // Split between shells, else where the highest bit changes; halve equal keys.
    Index middle = begin + (end - begin) / 2;
    const auto of = [&](Index i) { return shell_[keys[i].second]; };
    const std::uint64_t different = keys[begin].first ^ keys[end - 1].first;
    if (of(begin) != of(end - 1)) {
      const Index shell = std::max(of(middle), of(begin) + 1);
      middle = static_cast<Index>(
          std::partition_point(keys.begin() + begin, keys.begin() + end,
                               [&](const Key& key) { return shell_[key.second] < shell; }) -
          keys.begin());
    } else if (different != 0) {
      const std::uint64_t bit = std::bit_floor(different);
      const auto split =
          std::partition_point(keys.begin() + begin, keys.begin() + end,
                               [&](const auto& key) { return (key.first & bit) == 0; });
      middle = static_cast<Index>(split - keys.begin());
    }
    build(keys, begin, middle);
    const auto right = static_cast<Index>(nodes_.size());
    nodes_[self].right = right;
    build(keys, middle, end);
    nodes_[self].box = nodes_[self + 1].box;
    nodes_[self].box.add(nodes_[right].box);
    const Index face = nodes_[self + 1].face;
    nodes_[self].face = nodes_[right].face == face ? face : kNoFlatFace;
  }

  const ClosedSurface& surface_;
  const std::vector<Index>& shell_;
  std::vector<Index> order_;
  std::vector<Node> nodes_;
};

class WindingCheck {
 public:
  WindingCheck(const ClosedSurface& surface, double tolerance,
               const std::function<std::string(Index)>& name)
      : surface_(surface), tolerance_(tolerance), name_(name) {}

  Pockets run() {
    check_shells();
    faults_.throw_if_any();
    // Shells that bound solids and do not pass through themselves add up to no negative number,
    // wherever they pass through each other.
    if (all_bound_solids_ && are_simple()) return {};
    felt_ = felt_depth();
    at_pocket_.assign(surface_.triangles.size(), 0);
    shell_.assign(shell_.size(), 0);
    tree_.emplace(surface_, shell_);
    // Over triangles that cross no others, the number does not change from one to its neighbour.
    // Where two cross, a region of a lower number begins outside both.
    find_crossings();
    faults_.throw_if_any();
    check_regions();
    faults_.throw_if_any();
    return pockets();
  }

 private:
  const Vec3& corner(Index t, Index k) const {
    return surface_.vertices[surface_.triangles[t][k % 3]];
  }
  Vec3 area(Index t) const {
    return glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
  }
  Vec3 middle(Index t) const { return (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0; }

  template <class Visit>
  void flood(Index from, std::vector<char>& seen, Visit visit) {
    std::vector<Index> todo{from};
    seen[from] = 1;
    while (!todo.empty()) {
      const Index t = todo.back();
      todo.pop_back();
      visit(t);
      for (const Index n : surface_.across[t]) {
        if (seen[n] != 0) continue;
        seen[n] = 1;
        todo.push_back(n);
      }
    }
  }

  // Volumes of all shells, by the divergence theorem.
  void check_shells() {
    std::vector<char> seen(surface_.triangles.size(), 0);
    shell_.resize(seen.size());
    double total = 0, total_area = 0;
    for (Index t = 0; t < seen.size(); ++t) {
      if (seen[t] != 0) continue;
      const Vec3 origin = corner(t, 0);
      double volume = 0, whole_area = 0;
      flood(t, seen, [&](Index s) {
        shell_[s] = t;
        const Vec3 twice = area(s);
        volume += glm::dot(corner(s, 0) - origin, twice) / 6;
        whole_area += glm::length(twice) / 2;
      });
      all_bound_solids_ &= volume > tolerance_ / 2 * whole_area;
      total += volume;
      total_area += whole_area;
    }
    if (std::abs(total) <= tolerance_ / 2 * total_area) {
      faults_.add("flat", [] { return "expected a solid, found no volume"; });
    } else if (total < 0) {
      faults_.add("inside out", [] {
        return "all faces are clockwise seen from outside; expected counter-clockwise: turn the "
               "faces over in a modelling program";
      });
    }
  }

  // The winding number of the surface about a place: signed crossings of a ray along +z.
  int winding(const Vec3& q) const {
    int number = 0;
    std::array<Index, 128> stack{};
    std::size_t left = 0;
    stack[left++] = 0;
    while (left > 0) {
      const Index at = stack[--left];
      const Tree::Node& node = tree_->nodes()[at];
      const Vec3 low = node.box.lowest(), high = node.box.highest();
      if (q.x < low.x || q.x > high.x || q.y < low.y || q.y > high.y || q.z > high.z) continue;
      if (node.right != 0) {
        stack[left++] = node.right;
        stack[left++] = at + 1;
        continue;
      }
      for (Index i = node.begin; i < node.end; ++i) number += crossing(tree_->triangle(i), q);
    }
    return number;
  }

  int crossing(Index t, const Vec3& q) const {
    const Vec3 &a = corner(t, 0), &b = corner(t, 1), &c = corner(t, 2);
    const int side = side_of(a, b, q);
    if (side == 0 || side_of(b, c, q) != side || side_of(c, a, q) != side) return 0;
    const double height = glm::dot(area(t), q - a);
    return (height < 0) == (side > 0) ? side : 0;
  }

  // van Oosterom & Strackee 1983, and the distance to every triangle. Confirms a suspect place.
  bool truly_negative(const Vec3& q) const {
    double angle = 0;
    for (Index t = 0; t < surface_.triangles.size(); ++t) {
      const Vec3 a = corner(t, 0) - q, b = corner(t, 1) - q, c = corner(t, 2) - q;
      const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
      angle +=
          std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                        glm::dot(b, c) * la + glm::dot(c, a) * lb);
    }
    return angle / (2 * 3.14159265358979323846) < -0.5;
  }

  // m; a deeper pocket is refused. Files in other units are larger than what a hand can reach.
  double felt_depth() const {
    constexpr double kOfSize = 1e-3, kDepth = 1e-4, kOfLarge = 1e-4;
    Box all;
    for (const Vec3& v : surface_.vertices) all.add(v);
    const double size = glm::length(all.high - all.low);
    return std::min(kOfSize * size, std::max(kDepth, kOfLarge * size));
  }

  // m; how far a pocket reaches from a place in it along a direction; more than felt_: infinity.
  double depth_of(const Vec3& q, const Vec3& direction) const {
    constexpr int kHalvings = 24, kRefinements = 10;
    for (int k = kHalvings; k >= 0; --k) {
      double out = std::ldexp(felt_, -k), in = k == kHalvings ? 0 : 0.5 * out;
      if (winding(q + out * direction) < 0) continue;
      for (int i = 0; i < kRefinements; ++i) {
        const double middle = 0.5 * (in + out);
        (winding(q + middle * direction) < 0 ? in : out) = middle;
      }
      return out;
    }
    return std::numeric_limits<double>::infinity();
  }

  // Whether an edge of a triangle bounds a pocket somewhere.
  bool edge_at_pocket(Index t, Index k) const {
    const Vec3 a = corner(t, k), b = corner(t, k + 1);
    const Vec3 sum = glm::normalize(area(t)) + glm::normalize(area(surface_.across[t][k]));
    const double length = glm::length(sum);
    if (!(length > 0)) return false;
    return std::ranges::any_of(
        std::array{1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5, 0.9, 0.99, 1 - 1e-3, 1 - 1e-4, 1 - 1e-5,
                   1 - 1e-6},
        [&](double share) {
          return winding(glm::mix(a, b, share) + sum * (2 * tolerance_ / length)) < 0;
        });
  }

  // Numbers the triangles that bound a pocket beside t, from edge to edge: a sheet, which ends
  // where the surface folds back on itself.
  Index sheet_of(Index t) {
    constexpr double kFoldsBack = -0.75;  // cosine between normals
    if (sheet_.empty()) sheet_.assign(surface_.triangles.size(), 0);
    if (sheet_[t] != 0) return sheet_[t];
    const Index number = sheet_[t] = ++sheets_;
    std::vector<Index> todo{t};
    while (!todo.empty()) {
      const Index at = todo.back();
      todo.pop_back();
      for (Index k = 0; k < 3; ++k) {
        const Index n = surface_.across[at][k];
        if (sheet_[n] != 0 ||
            glm::dot(glm::normalize(area(at)), glm::normalize(area(n))) <= kFoldsBack ||
            !edge_at_pocket(at, k))
          continue;
        sheet_[n] = number;
        todo.push_back(n);
      }
    }
    return number;
  }

  // The triangles whose boxes are within felt_ of a place.
  std::vector<Index> near_to(const Vec3& q) const {
    Box reach;
    reach.add(q - felt_);
    reach.add(q + felt_);
    return tree_->meeting(reach);
  }

  // m; how deep a pocket is at a place beside one of its walls, t, from which it is wide: a pocket
  // that ends in a floor just beyond the far side. The wall opposite is then of the same sheet, and
  // the depth is the distance to another sheet. Infinity: more than felt_, or no such pocket.
  double depth_beside_wall(const Vec3& q, Index t) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    constexpr int kSteps = 8, kHalvings = 36;
    constexpr std::size_t kPlace = 1000,
                          kMostWork = 300'000'000;  // of a place; in all, some ten seconds
    if (beside_walls_ > kMostWork) return kNever;
    const Vec3 normal = glm::normalize(area(t));
    double in = 0, out = felt_;
    while (std::isfinite(out) && winding(q + out * normal) < 0) {
      in = out;
      out *= 2;
    }
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (in + out);
      (winding(q + middle * normal) < 0 ? in : out) = middle;
    }
    const Index sheet = sheet_of(t);
    const auto is_farther = [&](Index s, const Vec3& from, double than) {  // by its plane alone
      const Vec3 n = area(s);
      return std::abs(glm::dot(n, from - corner(s, 0))) > than * glm::length(n);
    };
    const auto way_to = [&](Index s, const Vec3& from) {
      return nearest_on_triangle({corner(s, 0), corner(s, 1), corner(s, 2)}, from) - from;
    };
    const Vec3 opposite = q + out * normal;
    const std::vector<Index> at_opposite = near_to(opposite), at_place = near_to(q);
    beside_walls_ += kPlace + at_opposite.size() + at_place.size();
    const double near = 4 * tolerance_;
    if (std::ranges::none_of(at_opposite, [&](Index s) {
          return sheet_[s] == sheet && !is_farther(s, opposite, near) &&
                 glm::length(way_to(s, opposite)) <= near;
        }))
      return kNever;
    double least = kNever;
    for (const Index s : at_place) {
      if (sheet_[s] == sheet || is_farther(s, q, std::min(least, felt_))) continue;
      const Vec3 way = way_to(s, q);
      bool within = glm::length(way) < least && glm::length(way) <= felt_;
      for (int i = 1; i < kSteps && within; ++i)
        within = winding(q + i / static_cast<double>(kSteps) * way) < 0;
      if (within) least = glm::length(way);
    }
    return least;
  }

  // Looks for a pocket outside a triangle.
  void examine(const Vec3& q, Index t, const char* why) {
    if (winding(q) >= 0) return;
    double depth = depth_of(q, glm::normalize(area(t)));
    if (depth > felt_ && accused_ <= kMostAccused) depth = depth_beside_wall(q, t);
    if (depth <= felt_) {
      at_pocket_[t] = 1;
      if (depth <= deepest_.depth) return;
      deepest_.depth = depth;
      deepest_.place = q;
      return;
    }
    if (accused_ > kMostAccused) return;
    ++accused_;
    if (!truly_negative(q)) return;
    faults_.add("negative", [&] {
      char text[200];
      std::snprintf(text, sizeof text,
                    ": the surface winds a negative number of times round a place near it, "
                    "(%.6g, %.6g, %.6g) m: ",
                    q.x, q.y, q.z);
      return name_(t) + text + why + "; repair and orient the faces in a modelling program";
    });
  }

  // Examines places just outside some triangles of each region that nothing crosses, and of all
  // others.
  void check_regions() {
    std::vector<char> seen = crossed_;
    for (Index t = 0; t < seen.size(); ++t) {
      if (crossed_[t] != 0) {
        examine_over(t, "it passes through itself");
        continue;
      }
      if (seen[t] != 0) continue;
      std::array<std::pair<double, Index>, 3> largest{};
      std::vector<Index> region;
      flood(t, seen, [&](Index s) {
        region.push_back(s);
        const double size = glm::length(area(s));
        if (size > largest[2].first) largest[2] = {size, s};
        if (largest[2].first > largest[1].first) std::swap(largest[2], largest[1]);
        if (largest[1].first > largest[0].first) std::swap(largest[1], largest[0]);
      });
      for (const auto& [size, s] : largest) {
        if (size > 0) examine_over(s, "a shell there is turned inside out");
      }
      const bool is_pocket = std::ranges::any_of(
          largest, [&](const auto& one) { return one.first > 0 && at_pocket_[one.second] != 0; });
      for (const Index s : region) {
        if (!is_pocket || !faults_.empty()) break;
        examine_all_over(s);
        at_pocket_[s] = 1;
      }
    }
    if (deepest_.depth == 0) return;
    for (Index t = 0; t < crossed_.size() && faults_.empty(); ++t) {
      if (crossed_[t] != 0) examine_all_over(t);
    }
  }

  // Places above a triangle: its middle, between its corners, and ever nearer to them, as pockets
  // are deepest there and may be small.
  void examine_all_over(Index t) {
    constexpr std::array<double, 4> kInwards = {1e-3, 1e-4, 1e-5, 1e-6};
    const Vec3 twice = area(t), centre = middle(t);
    const double size = glm::length(twice);
    if (!(size > 0)) return;
    for (Index i = 0; i <= 3; ++i) {
      for (Index k = 0; i + k <= 3; ++k) {
        const Vec3 at = (double(i) * corner(t, 0) + double(k) * corner(t, 1) +
                         double(3 - i - k) * corner(t, 2)) /
                        3.0;
        for (const double inwards : kInwards) {
          examine(at + inwards * (centre - at) + twice * (2 * tolerance_ / size), t,
                  "it passes through itself");
        }
      }
    }
  }

  Pockets pockets() {
    if (deepest_.depth == 0) return {};
    if (!truly_negative(deepest_.place)) deepest_.depth = 0;
    // A part of a triangle that crosses others may bound a pocket.
    for (Index t = 0; t < at_pocket_.size(); ++t) {
      if (at_pocket_[t] != 0 || crossed_[t] != 0) deepest_.triangles.push_back(t);
    }
    return std::move(deepest_);
  }

  void examine_over(Index t, const char* why) {
    const Vec3 twice = area(t);
    const double size = glm::length(twice);
    if (size > 0) examine(middle(t) + twice * (2 * tolerance_ / size), t, why);
  }

  // Whether no shell passes through itself.
  bool are_simple() {
    in_shells_ = true;
    tree_.emplace(surface_, shell_);
    find_crossings();
    in_shells_ = false;
    return budget_ > 0;
  }

  void find_crossings() {
    crossed_.assign(surface_.triangles.size(), 0);
    leaves_.assign(kLeaves, {});
    budget_ = 64 * surface_.triangles.size() + 100'000'000;
    cross(0, 0);
    if (budget_ == 0 && !in_shells_) {
      faults_.add("tangled", [] {
        return "too many faces pass through each other; remove those inside of the solid in a "
               "modelling program";
      });
    }
  }

  /// A triangle of a leaf, looked up once for all that it is compared with.
  struct Facet {
    Index t = 0;
    Triangle corners{};
    std::array<Vec3, 3> at;  ///< m
    Vec3 area;               ///< m^2, twice
    Box box;
  };
  struct Leaf {
    Index node = 0;  ///< 0: none; the root is a leaf of the smallest surfaces alone
    std::array<Facet, Tree::kLeaf> facets{};
  };

  const Leaf& leaf_of(Index node) {
    Leaf& leaf = leaves_[node % leaves_.size()];
    if (leaf.node == node && node != 0) return leaf;
    leaf.node = node;
    const Tree::Node& from = tree_->nodes()[node];
    for (Index i = from.begin; i < from.end; ++i) {
      Facet& facet = leaf.facets[i - from.begin];
      facet.t = tree_->triangle(i);
      facet.corners = surface_.triangles[facet.t];
      facet.box = Box();
      for (std::size_t k = 0; k < 3; ++k) {
        facet.at[k] = surface_.vertices[facet.corners[k]];
        facet.box.add(facet.at[k]);
      }
      facet.area = glm::cross(facet.at[1] - facet.at[0], facet.at[2] - facet.at[0]);
    }
    return leaf;
  }

  void cross(Index a, Index b) {
    if (budget_ == 0) return;
    const Tree::Node &x = tree_->nodes()[a], &y = tree_->nodes()[b];
    if (in_shells_ && tree_->shells_apart(x, y)) return;
    // Where a plane face lies on itself, its border does, and the triangles beyond the border are
    // found there. Long triangles of a polygon with many corners all have boxes that meet.
    if (x.face == y.face && x.face != kNoFlatFace) return;
    if (a != b) {
      if (!x.box.meets(y.box)) return;
      if (x.right == 0 && is_apart(leaf_of(a), x, y.box)) return;
      if (y.right == 0 && is_apart(leaf_of(b), y, x.box)) return;
    }
    if (x.right == 0 && y.right == 0) {
      cross_leaves(a, b);
    } else if (a == b) {
      cross(a + 1, a + 1);
      cross(x.right, x.right);
      cross(a + 1, x.right);
    } else if (y.right == 0 || (x.right != 0 && x.box.extent() >= y.box.extent())) {
      // Halve the larger box, not the larger number of triangles: leaves with long triangles
      // separate best (is_apart tests each triangle).
      cross(a + 1, b);
      cross(x.right, b);
    } else {
      cross(a, b + 1);
      cross(a, y.right);
    }
  }

  void cross_leaves(Index a, Index b) {
    const Tree::Node &x = tree_->nodes()[a], &y = tree_->nodes()[b];
    const Leaf of_x = leaf_of(a);  // the other one may take its place
    const Leaf& of_y = leaf_of(b);
    for (Index i = 0; i < x.end - x.begin; ++i) {
      for (Index k = a == b ? i + 1 : 0; k < y.end - y.begin; ++k)
        cross_pair(of_x.facets[i], of_y.facets[k]);
    }
  }

  // Whether each triangle of a leaf is apart from the box: of a long one, much of its own box is.
  bool is_apart(const Leaf& leaf, const Tree::Node& node, const SmallBox& box) const {
    const Vec3 middle = 0.5 * (box.lowest() + box.highest()), half = box.highest() - middle;
    const auto beyond = [&](const Vec3& way, const Vec3& from) {
      const double reach = glm::dot(glm::abs(way), half) + tolerance_ * glm::length(way);
      return glm::dot(way, middle - from) - reach;
    };
    for (Index i = 0; i < node.end - node.begin; ++i) {
      const Facet& t = leaf.facets[i];
      bool apart = beyond(t.area, t.at[0]) > 0 || beyond(-t.area, t.at[0]) > 0;
      for (std::size_t k = 0; k < 3 && !apart; ++k)
        apart = beyond(glm::cross(t.at[(k + 1) % 3] - t.at[k], t.area), t.at[k]) > 0;
      if (!apart) return false;
    }
    return true;
  }

  // Whether a plane across the way between their middles has the two triangles on its two sides,
  // but for a common corner. Most pairs of neighbours end here.
  bool are_on_two_sides(const Facet& s, const Facet& t, bool share_a_corner) const {
    const Vec3 way = (s.at[0] + s.at[1] + s.at[2]) - (t.at[0] + t.at[1] + t.at[2]);
    const double near = tolerance_ * (std::abs(way.x) + std::abs(way.y) + std::abs(way.z));
    std::array<double, 3> of_s{}, of_t{};
    for (std::size_t k = 0; k < 3; ++k) {
      of_s[k] = glm::dot(way, s.at[k] - s.at[0]);
      of_t[k] = glm::dot(way, t.at[k] - s.at[0]);
    }
    if (share_a_corner) {
      std::size_t i = 0, j = 0;
      while (std::ranges::find(t.corners, s.corners[i]) == t.corners.end()) ++i;
      while (t.corners[j] != s.corners[i]) ++j;
      // Their own two corners stand apart from the common one.
      const double common = of_s[i];
      of_s[i] = std::numeric_limits<double>::infinity();
      of_t[j] = -of_s[i];
      return std::ranges::min(of_s) > common + near && std::ranges::max(of_t) < common - near;
    }
    return std::ranges::min(of_s) > std::ranges::max(of_t) + near;
  }

  void cross_pair(const Facet& s, const Facet& t) {
    if (in_shells_ && shell_[s.t] != shell_[t.t]) return;
    if (budget_ > 0) --budget_;
    if (!s.box.meets(t.box)) return;  // with a common corner they do
    int shared = 0;
    for (const Index v : s.corners) {
      for (const Index w : t.corners) shared += v == w ? 1 : 0;
    }
    if (shared >= 2 || are_on_two_sides(s, t, shared == 1)) return;
    const Vec3 &n = s.area, &m = t.area;
    std::array<double, 3> of_t{}, of_s{};  // heights over the planes, times the areas
    for (std::size_t k = 0; k < 3; ++k) {
      of_t[k] = glm::dot(n, t.at[k] - s.at[0]);
      of_s[k] = glm::dot(m, s.at[k] - t.at[0]);
    }
    const double near_s = tolerance_ * glm::length(n), near_t = tolerance_ * glm::length(m);
    const auto apart = [](const std::array<double, 3>& h, double near) {
      return (h[0] > near && h[1] > near && h[2] > near) ||
             (h[0] < -near && h[1] < -near && h[2] < -near);
    };
    if (apart(of_t, near_s) || apart(of_s, near_t)) return;
    // Where the common line of both planes runs through both triangles (Moeller 1997).
    const Vec3 along = glm::cross(n, m);
    const double steep = glm::length(along);
    if (steep <= 1e-9 * glm::length(n) * glm::length(m)) {  // in one plane
      if (shared > 0 || is_beside(s.t, t.t) || is_beside(t.t, s.t)) return;
      mark(s.t, t.t);
      return;
    }
    Vec3 s_low, s_high, t_low, t_high;
    if (!cut(s.t, of_s, s_low, s_high, along) || !cut(t.t, of_t, t_low, t_high, along)) return;
    const double low_s = glm::dot(along, s_low - s_low), high_s = glm::dot(along, s_high - s_low);
    const double low_t = glm::dot(along, t_low - s_low), high_t = glm::dot(along, t_high - s_low);
    const double low = std::max(low_s, low_t), high = std::min(high_s, high_t);
    if (low > high) return;
    if (shared == 1 && high - low <= tolerance_ * steep) return;  // only in the shared corner
    mark(s.t, t.t);
    if (in_shells_) return;
    const Vec3 unit_n = glm::normalize(n), unit_m = glm::normalize(m), sum = unit_n + unit_m;
    const double outside = glm::dot(sum, unit_n);  // of both
    if (outside < 1e-3) return;
    const Vec3 at = s_low + along * ((low + high) / 2 / (steep * steep));
    examine(at + sum * (2 * tolerance_ / outside), s.t, "it passes through itself");
  }

  void mark(Index s, Index t) {
    crossed_[s] = crossed_[t] = 1;
    if (in_shells_) budget_ = 0;  // one is enough
  }

  // Whether one triangle is beyond some side of another one in its plane.
  bool is_beside(Index s, Index t) const {
    const Vec3 n = area(t);
    for (Index k = 0; k < 3; ++k) {
      const Vec3 out = glm::cross(corner(t, k + 1) - corner(t, k), n);
      const double near = tolerance_ * glm::length(out);
      double least = std::numeric_limits<double>::max();
      for (Index j = 0; j < 3; ++j)
        least = std::min(least, glm::dot(out, corner(s, j) - corner(t, k)));
      if (least > near) return true;
    }
    return false;
  }

  // The ends of the section of a triangle with a plane; the corners have these heights over it.
  bool cut(Index t, const std::array<double, 3>& height, Vec3& low, Vec3& high,
           const Vec3& along) const {
    std::array<Vec3, 6> ends;
    std::size_t count = 0;
    for (Index k = 0; k < 3; ++k) {
      const double a = height[k], b = height[(k + 1) % 3];
      if (a == 0) ends[count++] = corner(t, k);
      if ((a < 0 && b > 0) || (a > 0 && b < 0))
        ends[count++] = corner(t, k) + (corner(t, k + 1) - corner(t, k)) * (a / (a - b));
    }
    if (count == 0) return false;
    low = high = ends[0];
    for (std::size_t i = 1; i < count; ++i) {
      if (glm::dot(along, ends[i] - low) < 0) low = ends[i];
      if (glm::dot(along, ends[i] - high) > 0) high = ends[i];
    }
    return true;
  }

  const ClosedSurface& surface_;
  const double tolerance_;
  const std::function<std::string(Index)>& name_;
  std::optional<Tree> tree_;
  MeshFaults faults_;
  std::vector<Index> shell_;      ///< of each triangle, its first one
  bool all_bound_solids_ = true;  ///< none is turned inwards
  bool in_shells_ = false;        ///< look only for shells that pass through themselves
  std::vector<char> crossed_;
  static constexpr std::size_t kLeaves = 64;
  std::vector<Leaf> leaves_;  ///< lately looked up, each at the rest of its number by kLeaves
  double felt_ = 0;           ///< m
  std::vector<char> at_pocket_;
  Pockets deepest_;
  std::size_t budget_ = 0;
  static constexpr int kMostAccused = 32;  ///< places looked at closely
  int accused_ = 0;
  std::vector<Index> sheet_;  ///< number of each triangle's sheet, from 1; 0: none yet
  Index sheets_ = 0;
  std::size_t beside_walls_ = 0;  ///< work at places beside walls, in triangles looked at
};

}  // namespace

Pockets check_winding(const ClosedSurface& surface, double tolerance,
                      const std::function<std::string(Index)>& name) {
  return WindingCheck(surface, tolerance, name).run();
}

}  // namespace palpate::stimuli
