#include "stimuli/flat_triangles.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <iterator>
#include <utility>

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;
constexpr Index kGone = 0xffffffff;

class Flattening {
 public:
  Flattening(const std::vector<Vec3>& points, std::vector<Triangle>& triangles,
             std::vector<Triangle>& across, double tolerance)
      : points_(points), triangles_(triangles), across_(across), tolerance_(tolerance) {}

  std::size_t run() {
    std::vector<Index> first;
    for (Index t = 0; t < triangles_.size(); ++t) {
      if (flat(triangles_[t])) first.push_back(t);
    }
    // Some only can be taken out after others.
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
    return first.size() > left.size() ? first.size() - left.size() : 0;
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

  // Makes what lies over (t, k) and over (s, j) neighbours of each other.
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
    // Else two other edges would become one, of four triangles.
    if (common.size() != 2 && !last_resort_) return false;
    const Index end = triangles_[t][(k + 1) % 3], begin = triangles_[t][k];
    if (std::count(ring_from.begin(), ring_from.end(), end) != 1 ||
        std::count(ring_to.begin(), ring_to.end(), begin) != 1)
      return false;
    return move(from, t, k, n, j) || move(to, n, j, t, k);
  }

  // Moves the corner that side k of t begins in to the side's other end.
  bool move(const std::vector<std::pair<Index, Index>>& around, Index t, Index k, Index n,
            Index j) {
    const Index to = triangles_[t][(k + 1) % 3];
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
  bool last_resort_ = false;
};

}  // namespace

std::size_t collapse_flat_triangles(const std::vector<Vec3>& points,
                                    std::vector<Triangle>& triangles, std::vector<Triangle>& across,
                                    double tolerance) {
  return Flattening(points, triangles, across, tolerance).run();
}

}  // namespace palpate::stimuli
