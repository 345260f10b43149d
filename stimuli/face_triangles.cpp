#include "stimuli/face_triangles.h"

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <iterator>
#include <numeric>
#include <queue>
#include <unordered_map>
#include <utility>

namespace palpate::stimuli {
namespace {

Vec3 farthest_from(const Vec3& point, std::span<const Vec3> corners) {
  Vec3 farthest = point;
  double most = 0;
  for (const Vec3& corner : corners) {
    const Vec3 apart = corner - point;
    const double squared = glm::dot(apart, apart);
    if (squared <= most) continue;
    most = squared;
    farthest = corner;
  }
  return farthest;
}

using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;
constexpr Index kGone = 0xffffffff;

class Flattening {
 public:
  Flattening(const std::vector<Vec3>& points, std::vector<Triangle>& triangles,
             std::vector<Triangle>& across, double tolerance)
      : points_(points), triangles_(triangles), across_(across), tolerance_(tolerance) {}

  Flattened run() {
    std::vector<Index> first;
    for (Index t = 0; t < triangles_.size(); ++t) {
      if (flat(triangles_[t])) first.push_back(t);
    }
    // Some triangles can only be taken out after others.
    std::vector<Index> left = first;
    for (int round = 0; round < 16 && !left.empty(); ++round) {
      last_resort_ = round > 1;
      todo_ = left;
      // A flip can make another flat triangle, so the number of steps is bounded.
      for (std::size_t steps = 16 * left.size() + 16; !todo_.empty() && steps > 0; --steps) {
        const Index t = todo_.back();
        todo_.pop_back();
        if (!gone(t) && flat(triangles_[t])) take_out(t);
      }
      const std::size_t before = left.size();
      left.insert(left.end(), touched_.begin(), touched_.end());
      touched_.clear();
      std::sort(left.begin(), left.end());
      left.erase(std::unique(left.begin(), left.end()), left.end());
      std::erase_if(left, [&](Index t) { return gone(t) || !flat(triangles_[t]); });
      if (left.size() >= before && round > 2) break;
    }
    result_.triangles = first.size() > left.size() ? first.size() - left.size() : 0;
    return result_;
  }

 private:
  bool gone(Index t) const { return triangles_[t][0] == kGone; }
  Vec3 area(const Triangle& t) const {
    return glm::cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]);
  }
  double length(const Triangle& t, Index k) const {
    return glm::distance(points_[t[k]], points_[t[(k + 1) % 3]]);
  }
  bool flat(const Triangle& t) const {
    const double longest = std::max({length(t, 0), length(t, 1), length(t, 2)});
    return glm::length(area(t)) <= tolerance_ * longest;
  }

  // The side of n that t lies over, along t's side k.
  Index back(Index t, Index k, Index n) const {
    const Index from = triangles_[t][(k + 1) % 3];
    Index j = 0;
    while (triangles_[n][j] != from) ++j;
    return j;
  }

  // Makes the triangles over (t, k) and over (s, j) neighbours of each other.
  void join(Index t, Index k, Index s, Index j) {
    const Index a = across_[t][k], b = across_[s][j];
    if (a == s || b == t) return;
    const Index side_a = back(t, k, a), side_b = back(s, j, b);
    across_[a][side_a] = b;
    across_[b][side_b] = a;
    todo_.push_back(a);
    todo_.push_back(b);
  }

  void remove(Index t) { triangles_[t] = {kGone, kGone, kGone}; }

  void take_out(Index t) {
    Index shortest = 0, longest = 0;
    for (Index k = 1; k < 3; ++k) {
      if (length(triangles_[t], k) < length(triangles_[t], shortest)) shortest = k;
      if (length(triangles_[t], k) > length(triangles_[t], longest)) longest = k;
    }
    if (drop_fin(t)) return;
    if (length(triangles_[t], shortest) <= tolerance_ && collapse(t, shortest)) return;
    flip(t, longest);
  }

  // Two triangles with the same corners, back to back.
  bool drop_fin(Index t) {
    for (Index k = 0; k < 3; ++k) {
      const Index n = across_[t][k], j = back(t, k, n);
      if (triangles_[n][(j + 2) % 3] != triangles_[t][(k + 2) % 3]) continue;
      join(t, (k + 1) % 3, n, (j + 2) % 3);
      join(t, (k + 2) % 3, n, (j + 1) % 3);
      remove(t);
      remove(n);
      return true;
    }
    return false;
  }

  // (triangle, side that begins in the corner) round a corner of t.
  std::vector<std::pair<Index, Index>> fan(Index t, Index k) const {
    std::vector<std::pair<Index, Index>> around;
    const Index begin = t;
    do {
      around.emplace_back(t, k);
      const Index n = across_[t][k], j = back(t, k, n);
      t = n;
      k = (j + 1) % 3;
    } while (t != begin);
    return around;
  }

  std::vector<Index> ring(const std::vector<std::pair<Index, Index>>& around) const {
    std::vector<Index> corners;
    corners.reserve(around.size());
    for (const auto& [t, k] : around) corners.push_back(triangles_[t][(k + 1) % 3]);
    std::sort(corners.begin(), corners.end());
    return corners;
  }

  bool collapse(Index t, Index k) {
    const Index n = across_[t][k], j = back(t, k, n);
    const auto from = fan(t, k), to = fan(n, j);
    const std::vector<Index> ring_from = ring(from), ring_to = ring(to);
    std::vector<Index> common;
    std::set_intersection(ring_from.begin(), ring_from.end(), ring_to.begin(), ring_to.end(),
                          std::back_inserter(common));
    // Otherwise two other edges would merge into one edge of four triangles.
    if (common.size() != 2 && !last_resort_) return false;
    const Index end = triangles_[t][(k + 1) % 3], begin = triangles_[t][k];
    if (std::count(ring_from.begin(), ring_from.end(), end) != 1 ||
        std::count(ring_to.begin(), ring_to.end(), begin) != 1)
      return false;
    return move(from, t, k, n, j) || move(to, n, j, t, k);
  }

  // Collapses side k of t onto its second corner.
  bool move(const std::vector<std::pair<Index, Index>>& around, Index t, Index k, Index n,
            Index j) {
    const Index from = triangles_[t][k], to = triangles_[t][(k + 1) % 3];
    for (const auto& [s, i] : around) {
      if (s == t || s == n || flat(triangles_[s])) continue;
      Triangle moved = triangles_[s];
      moved[i] = to;
      if (glm::dot(area(moved), area(triangles_[s])) <= 0) return false;
    }
    // Sides of t: k from the corner, k + 1 from `to`, k + 2 back to the corner; n: j from `to`.
    join(t, (k + 1) % 3, t, (k + 2) % 3);
    join(n, (j + 1) % 3, n, (j + 2) % 3);
    for (const auto& [s, i] : around) triangles_[s][i] = to;
    remove(t);
    remove(n);
    ++result_.corners;
    double& travelled = travelled_[to];
    travelled = std::max(travelled, travelled_[from] + glm::distance(points_[from], points_[to]));
    result_.farthest = std::max(result_.farthest, travelled);
    for (const auto& [s, i] : around) {
      todo_.push_back(s);
      touched_.push_back(s);
    }
    return true;
  }

  // Cuts the neighbour over side k, the longest, at the opposite corner.
  void flip(Index t, Index k) {
    const Index n = across_[t][k], j = back(t, k, n);
    const Index c = triangles_[t][k], a = triangles_[t][(k + 1) % 3],
                b = triangles_[t][(k + 2) % 3], d = triangles_[n][(j + 2) % 3];
    const Triangle one{a, b, d}, other{b, c, d};
    if (flat(triangles_[n])) {
      if (glm::distance(points_[b], points_[d]) >= glm::distance(points_[a], points_[c])) return;
    } else {
      const Vec3 normal = area(triangles_[n]);
      const auto fits = [&](const Triangle& piece) {
        return glm::dot(area(piece), normal) > 0 || (last_resort_ && flat(piece));
      };
      if (!fits(one) || !fits(other)) return;
    }
    const Index over_ab = across_[t][(k + 1) % 3], over_bc = across_[t][(k + 2) % 3],
                over_cd = across_[n][(j + 1) % 3], over_da = across_[n][(j + 2) % 3];
    // t keeps a-b and gets d-a; n keeps c-d and gets b-c.
    const Index side_bc = back(t, (k + 2) % 3, over_bc), side_da = back(n, (j + 2) % 3, over_da);
    triangles_[t] = one;
    triangles_[n] = other;
    across_[t] = {over_ab, n, over_da};
    across_[n] = {over_bc, over_cd, t};
    across_[over_bc][side_bc] = n;
    across_[over_da][side_da] = t;
    for (const Index s : {t, n}) {
      todo_.push_back(s);
      touched_.push_back(s);
    }
  }

  const std::vector<Vec3>& points_;
  std::vector<Triangle>& triangles_;
  std::vector<Triangle>& across_;
  const double tolerance_;
  std::vector<Index> todo_, touched_;
  std::unordered_map<Index, double> travelled_;  ///< m, of the corners merged into one
  Flattened result_;
  bool last_resort_ = false;
};
using Vec2 = glm::dvec2;

double turn_of(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
}

// The least sine of a triangle's angles, negative where it is turned: its shape.
double shape_of(const Vec2& a, const Vec2& b, const Vec2& c) {
  const double ab = glm::distance(a, b), bc = glm::distance(b, c), ca = glm::distance(c, a);
  const double longest = std::max({ab, bc, ca});
  const double shortest = std::min({ab, bc, ca}), middle = ab + bc + ca - longest - shortest;
  return longest > 0 ? turn_of(a, b, c) / (longest * std::max(middle, 1e-300)) : 0;
}

class FaceCutter {
  /// Faces of scans and CAD programs take some tens of steps a corner.
  static constexpr std::size_t kMostSteps = 20'000'000, kMostStepsACorner = 1000;

 public:
  explicit FaceCutter(std::vector<Vec2> corners)
      : at_(std::move(corners)),
        count_(static_cast<Index>(at_.size())),
        next_(count_),
        previous_(count_),
        gone_(count_, 0),
        version_(count_, 0) {
    for (Index i = 0; i < count_; ++i) {
      next_[i] = i + 1 == count_ ? 0 : i + 1;
      previous_[next_[i]] = i;
    }
    for (Index i = 0; i < count_; ++i) {
      if (concave(i)) concave_.push_back(i);
    }
    std::sort(concave_.begin(), concave_.end(),
              [&](Index a, Index b) { return at_[a].x < at_[b].x; });
  }

  std::vector<Triangle> run() {
    Index left = count_;
    while (left > 3) {
      queue_all();
      const Index before = left;
      while (left > 3 && !ears_.empty() && !tired()) {
        const Ear ear = ears_.top();
        ears_.pop();
        if (gone_[ear.corner] != 0 || version_[ear.corner] != ear.version) continue;
        if (ear.shape < 0 || occupied(ear.corner)) continue;
        cut(ear.corner);
        --left;
      }
      steps_ += 16 * static_cast<std::size_t>(count_);  // of a round
      if (tired()) break;
      if (left == before) {  // crossed: take the least turned ear
        cut(best_corner());
        --left;
      }
    }
    // A face that crosses itself at every turn would take the square of its corners.
    for (const Index from = first_left(); left > 3; --left) cut_off(next_[from]);
    const Index a = first_left();
    triangles_.push_back({a, next_[a], previous_[a]});
    return std::move(triangles_);
  }

 private:
  struct Ear {
    double shape;
    Index corner, version;
    bool operator<(const Ear& other) const {
      return shape != other.shape ? shape < other.shape : corner > other.corner;
    }
  };

  bool tired() const { return steps_ > kMostSteps + kMostStepsACorner * count_; }

  Index first_left() const {
    Index i = 0;
    while (gone_[i] != 0) ++i;
    return i;
  }

  double shape(Index i) const { return shape_of(at_[previous_[i]], at_[i], at_[next_[i]]); }
  bool concave(Index i) const { return turn_of(at_[previous_[i]], at_[i], at_[next_[i]]) < 0; }
  void queue(Index i) { ears_.push({shape(i), i, version_[i]}); }

  void queue_all() {
    ears_ = {};
    for (Index i = 0; i < count_; ++i) {
      if (gone_[i] == 0) queue(i);
    }
    std::erase_if(concave_, [&](Index i) { return gone_[i] != 0 || !concave(i); });
  }

  Index best_corner() const {
    Index best = first_left();
    for (Index i = 0; i < count_; ++i) {
      if (gone_[i] == 0 && shape(i) > shape(best)) best = i;
    }
    return best;
  }

  // Whether a concave corner lies in the triangle that would be cut off.
  bool occupied(Index i) {
    const Vec2 &a = at_[previous_[i]], &b = at_[i], &c = at_[next_[i]];
    const auto first = std::lower_bound(concave_.begin(), concave_.end(), std::min({a.x, b.x, c.x}),
                                        [&](Index k, double x) { return at_[k].x < x; });
    const auto end = std::upper_bound(first, concave_.end(), std::max({a.x, b.x, c.x}),
                                      [&](double x, Index k) { return x < at_[k].x; });
    steps_ += static_cast<std::size_t>(end - first);
    return std::any_of(first, end, [&](Index k) {
      const Vec2& p = at_[k];
      if (gone_[k] != 0 || p == a || p == b || p == c) return false;
      return turn_of(a, b, p) >= 0 && turn_of(b, c, p) >= 0 && turn_of(c, a, p) >= 0;
    });
  }

  void cut_off(Index i) {
    const Index before = previous_[i], after = next_[i];
    triangles_.push_back({before, i, after});
    gone_[i] = 1;
    next_[before] = after;
    previous_[after] = before;
  }

  void cut(Index i) {
    const Index before = previous_[i], after = next_[i];
    cut_off(i);
    for (const Index k : {before, after}) {
      ++version_[k];
      queue(k);
    }
  }

  const std::vector<Vec2> at_;
  const Index count_;
  std::vector<Index> next_, previous_;
  std::vector<char> gone_;
  std::vector<Index> version_;
  std::vector<Index> concave_;  // along x; once concave, some no longer are
  std::priority_queue<Ear> ears_;
  std::size_t steps_ = 0;
  std::vector<Triangle> triangles_;
};

std::vector<Vec2> seen_along(const Vec3& normal, std::span<const Vec3> corners) {
  const Vec3 helper = std::abs(normal.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 x = glm::normalize(glm::cross(helper, normal)), y = glm::cross(normal, x);
  std::vector<Vec2> flat;
  flat.reserve(corners.size());
  for (const Vec3& corner : corners)
    flat.emplace_back(glm::dot(x, corner - corners[0]), glm::dot(y, corner - corners[0]));
  return flat;
}

}  // namespace

PolygonPlane plane_of(std::span<const Vec3> corners) {
  PolygonPlane plane;
  for (const Vec3& corner : corners) plane.middle += corner - corners[0];
  plane.middle = corners[0] + plane.middle / static_cast<double>(corners.size());
  // Newell's method, about the middle.
  Vec3 twice_area;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const std::size_t next = k + 1 == corners.size() ? 0 : k + 1;
    twice_area += glm::cross(corners[k] - plane.middle, corners[next] - plane.middle);
  }
  // In a long and narrow polygon the products are large compared with their sum, and rounding tilts
  // the normal along the length, where it matters most: the far end of a needle would stand out.
  // The direction of the length is known well, so that component is removed.
  const Vec3 end = farthest_from(plane.middle, corners);
  const Vec3 chord = farthest_from(end, corners) - end;
  plane.diameter = glm::length(chord);
  if (plane.diameter > 0) {
    const Vec3 along = chord / plane.diameter;
    twice_area -= glm::dot(twice_area, along) * along;
  }
  const double length = glm::length(twice_area);
  plane.area = length / 2;
  if (length > 0) plane.normal = twice_area / length;
  return plane;
}

Flattened collapse_flat_triangles(const std::vector<Vec3>& points, std::vector<Triangle>& triangles,
                                  std::vector<Triangle>& across, double tolerance) {
  return Flattening(points, triangles, across, tolerance).run();
}

std::vector<Triangle> face_triangles(std::span<const Vec3> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  const Vec3 normal = plane_of(corners).normal;
  return FaceCutter(seen_along(normal == Vec3(0) ? Vec3(0, 0, 1) : normal, corners)).run();
}

}  // namespace palpate::stimuli
