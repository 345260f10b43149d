#include "stimuli/grid_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <utility>

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
constexpr Index kNotSet = 0xffffffff;

// Grid coordinates are below 2^40, so a height, a triple product, is below 2^124.
constexpr double kMostSteps = 0x1p40;
__extension__ using Wide = __int128;
using GridPoint = std::array<std::int64_t, 3>;

struct Face {
  std::array<Index, 3> corner{};
  std::array<Index, 3> across{};  // beyond the side from corner k to the next
  std::array<Wide, 3> normal{};   // outward, twice the area long
  double length = 0;              // of the normal
  std::vector<Index> outside;     // points in front of it
  std::vector<Index> inside;      // points not far behind it
  bool gone = false;
};

// Quickhull (Barber, Dobkin & Huhdanpaa 1996). Departs: heights are exact, so that nothing needs to
// be merged; a point in the plane of a facet does not see it. Points inside are handed on as well,
// to find their depth at the end.
class Hull {
 public:
  explicit Hull(std::vector<GridPoint> grid_points) : points_(std::move(grid_points)) {}

  bool build() {
    if (!begin()) return false;
    while (!waiting_.empty()) {
      const Index face = waiting_.back();
      waiting_.pop_back();
      if (!faces_[face].gone && !faces_[face].outside.empty()) take_highest(face);
    }
    return true;
  }

  const std::vector<Face>& faces() const { return faces_; }
  double height(const Face& face, Index point) const {
    return static_cast<double>(exact_height(face, point)) / face.length;
  }

 private:
  GridPoint apart(Index from, Index to) const {
    const GridPoint &a = points_[from], &b = points_[to];
    return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  }

  static std::array<Wide, 3> cross(const GridPoint& a, const GridPoint& b) {
    return {Wide{a[1]} * b[2] - Wide{a[2]} * b[1], Wide{a[2]} * b[0] - Wide{a[0]} * b[2],
            Wide{a[0]} * b[1] - Wide{a[1]} * b[0]};
  }

  Wide exact_height(const Face& face, Index point) const {
    const GridPoint arm = apart(face.corner[0], point);
    return face.normal[0] * arm[0] + face.normal[1] * arm[1] + face.normal[2] * arm[2];
  }

  Face face_of(Index a, Index b, Index c) const {
    Face face;
    face.corner = {a, b, c};
    face.normal = cross(apart(a, b), apart(a, c));
    face.length =
        std::hypot(static_cast<double>(face.normal[0]), static_cast<double>(face.normal[1]),
                   static_cast<double>(face.normal[2]));
    return face;
  }

  // The point for which `measure` is largest.
  template <class Measure>
  Index most(Measure measure) const {
    Index best = 0;
    for (Index i = 1; i < points_.size(); ++i) {
      if (measure(i) > measure(best)) best = i;
    }
    return best;
  }

  bool begin() {
    const Index a = most([&](Index i) { return -points_[i][0]; });
    const Index b = most([&](Index i) {
      const GridPoint d = apart(a, i);
      return Wide{d[0]} * d[0] + Wide{d[1]} * d[1] + Wide{d[2]} * d[2];
    });
    const Index c = most([&](Index i) { return face_of(a, b, i).length; });
    const Face base = face_of(a, b, c);
    const Index d = most([&](Index i) {
      const Wide height = exact_height(base, i);
      return height < 0 ? -height : height;
    });
    const Wide up = exact_height(base, d);
    if (up == 0) return false;
    const Index left = up < 0 ? b : c, right = up < 0 ? c : b;
    faces_ = {face_of(a, left, right), face_of(a, d, left), face_of(left, d, right),
              face_of(right, d, a)};
    faces_[0].across = {1, 2, 3};
    faces_[1].across = {3, 2, 0};
    faces_[2].across = {1, 3, 0};
    faces_[3].across = {2, 1, 0};
    std::vector<Index> others;
    for (Index i = 0; i < points_.size(); ++i) {
      if (i != a && i != b && i != c && i != d) others.push_back(i);
    }
    hand_out(others, 0);
    return true;
  }

  // Assigns each point to the face (index >= `first`) that it is farthest above.
  void hand_out(const std::vector<Index>& points, Index first) {
    for (const Index point : points) {
      Index best = first;
      double highest = -std::numeric_limits<double>::max();
      for (Index f = first; f < faces_.size(); ++f) {
        const double above = height(faces_[f], point);
        if (above <= highest) continue;
        highest = above;
        best = f;
      }
      Face& face = faces_[best];
      (highest > 0 ? face.outside : face.inside).push_back(point);
    }
    for (Index f = first; f < faces_.size(); ++f) {
      if (!faces_[f].outside.empty()) waiting_.push_back(f);
    }
  }

  struct Side {
    Index from, to, beyond;
  };

  // Removes the faces that `point` sees, from `start` on. Returns the sides between them and the
  // rest.
  std::vector<Side> remove_seen(Index start, Index point, std::vector<Index>& freed) {
    std::vector<Side> horizon;
    std::vector<Index> border{start};
    faces_[start].gone = true;
    while (!border.empty()) {
      Face& face = faces_[border.back()];
      border.pop_back();
      for (std::vector<Index>* list : {&face.outside, &face.inside}) {
        for (const Index other : *list) {
          if (other != point) freed.push_back(other);
        }
        std::vector<Index>().swap(*list);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const Index beyond = face.across[k];
        if (faces_[beyond].gone) continue;
        if (exact_height(faces_[beyond], point) > 0) {
          faces_[beyond].gone = true;
          border.push_back(beyond);
        } else {
          horizon.push_back({face.corner[k], face.corner[(k + 1) % 3], beyond});
        }
      }
    }
    return horizon;
  }

  void take_highest(Index start) {
    const std::vector<Index>& outside = faces_[start].outside;
    Index point = outside[0];
    for (const Index other : outside) {
      if (exact_height(faces_[start], other) > exact_height(faces_[start], point)) point = other;
    }
    std::vector<Index> freed;
    const std::vector<Side> horizon = remove_seen(start, point, freed);
    const auto first = static_cast<Index>(faces_.size());
    face_from_.resize(points_.size(), kNotSet);
    for (const Side& side : horizon) {
      const auto made = static_cast<Index>(faces_.size());
      faces_.push_back(face_of(side.from, side.to, point));
      faces_[made].across[0] = side.beyond;
      Face& beyond = faces_[side.beyond];
      for (std::size_t k = 0; k < 3; ++k) {
        if (beyond.corner[k] == side.to) beyond.across[k] = made;
      }
      face_from_[side.from] = made;
    }
    for (Index f = first; f < faces_.size(); ++f) {
      const Index next = face_from_[faces_[f].corner[1]];
      faces_[f].across[1] = next;
      faces_[next].across[2] = f;
    }
    hand_out(freed, first);
  }

  std::vector<GridPoint> points_;
  std::vector<Face> faces_;
  std::vector<Index> waiting_;
  std::vector<Index> face_from_;  // of each point: the new face whose first corner it is
};

}  // namespace

GridHull grid_hull(const std::vector<Vec3>& points, double error) {
  GridHull result;
  if (points.size() < 4) return result;
  Vec3 low = points[0], high = low;
  for (const Vec3& point : points) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  const Vec3 extent = high - low, far = glm::max(glm::abs(low), glm::abs(high));
  const double size = std::max({extent.x, extent.y, extent.z});
  // A power of two, no finer than the spacing of doubles at this distance from the origin, so that
  // grid points are doubles.
  const double least =
      std::max({error / 8, 2 * size / kMostSteps,
                std::numeric_limits<double>::epsilon() * std::max({far.x, far.y, far.z})});
  const double step = std::exp2(std::ceil(std::log2(least)));
  const Vec3 origin = step * glm::floor(low / step);
  std::vector<GridPoint> grid_points;
  grid_points.reserve(points.size());
  for (const Vec3& point : points) {
    const Vec3 steps = (point - origin) / step;
    grid_points.push_back({std::llround(steps.x), std::llround(steps.y), std::llround(steps.z)});
  }
  Hull hull(grid_points);
  if (!hull.build()) return result;
  std::vector<Index> number(points.size(), kNotSet);
  for (const Face& face : hull.faces()) {
    if (face.gone) continue;
    std::vector<Index> corners;
    for (const Index corner : face.corner) {
      if (number[corner] == kNotSet) {
        number[corner] = static_cast<Index>(result.soup.vertices.size());
        const GridPoint& grid_point = grid_points[corner];
        result.point.push_back(corner);
        result.soup.vertices.push_back(origin + step * Vec3(static_cast<double>(grid_point[0]),
                                                            static_cast<double>(grid_point[1]),
                                                            static_cast<double>(grid_point[2])));
      }
      corners.push_back(number[corner]);
    }
    result.soup.faces.push_back(std::move(corners));
    for (const Index point : face.inside) {
      result.depth = std::max(result.depth, -step * hull.height(face, point));
    }
  }
  return result;
}

}  // namespace palpate::stimuli
