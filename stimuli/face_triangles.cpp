#include "stimuli/face_triangles.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numeric>
#include <queue>

#include "stimuli/polygon.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
using Vec2 = glm::dvec2;
using Triangle = std::array<Index, 3>;

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
  }

  std::vector<Triangle> run() {
    Index left = count_;
    while (left > 3) {
      queue_all();
      const Index before = left;
      while (left > 3 && !ears_.empty()) {
        const Ear ear = ears_.top();
        ears_.pop();
        if (gone_[ear.corner] != 0 || version_[ear.corner] != ear.version) continue;
        if (ear.shape < 0 || occupied(ear.corner)) continue;
        cut(ear.corner);
        --left;
      }
      if (left == before) {  // crossed: the least turned one
        cut(best_corner());
        --left;
      }
    }
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
  bool occupied(Index i) const {
    const Vec2 &a = at_[previous_[i]], &b = at_[i], &c = at_[next_[i]];
    return std::any_of(concave_.begin(), concave_.end(), [&](Index k) {
      const Vec2& p = at_[k];
      if (gone_[k] != 0 || p == a || p == b || p == c) return false;
      return turn_of(a, b, p) >= 0 && turn_of(b, c, p) >= 0 && turn_of(c, a, p) >= 0;
    });
  }

  void cut(Index i) {
    const Index before = previous_[i], after = next_[i];
    triangles_.push_back({before, i, after});
    gone_[i] = 1;
    next_[before] = after;
    previous_[after] = before;
    for (const Index k : {before, after}) {
      ++version_[k];
      queue(k);
    }
  }

  const std::vector<Vec2> at_;
  const Index count_;
  std::vector<Index> next_, previous_;
  std::vector<char> gone_;
  std::vector<Index> version_, concave_;  // those that were concave: some are no longer
  std::priority_queue<Ear> ears_;
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

std::vector<Triangle> face_triangles(std::span<const Vec3> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  const Vec3 normal = plane_of(corners).normal;
  return FaceCutter(seen_along(normal == Vec3(0) ? Vec3(0, 0, 1) : normal, corners)).run();
}

}  // namespace palpate::stimuli
