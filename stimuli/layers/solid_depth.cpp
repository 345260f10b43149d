#include "stimuli/layers/solid_depth.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>
#include <vector>

namespace palpate::stimuli {
namespace {

/// Of the size: parts of a compound are placed by numbers of six digits or more.
constexpr double kAbutting = 1e-6;

std::vector<CornerTriangle> corners_of_shells(std::span<const PlacedShell> shells) {
  std::vector<CornerTriangle> out;
  for (const auto& [surface, pose] : shells) {
    for (const auto& t : surface->triangles) {
      CornerTriangle& corners = out.emplace_back();
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = pose.orientation * surface->vertices[t[k]] + pose.position;
    }
  }
  return out;
}

double slack_of(std::span<const PlacedShell> shells, const TriangleTree& tree) {
  double error = 0;
  for (const PlacedShell& shell : shells) error = std::max(error, shell.surface->coordinate_error);
  return tree.empty() ? 0 : kAbutting * glm::length(tree.box().high - tree.box().low) + 4 * error;
}

Vec3 twice_area(const CornerTriangle& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); }

Vec3 normal_of(const CornerTriangle& t) {
  const Vec3 twice = twice_area(t);
  const double length = glm::length(twice);
  return length > 0 ? twice / length : Vec3(0);
}

/// The pieces of a solid's triangles that are its surface: outside of them lies no solid.
class ExposedPieces {
 public:
  ExposedPieces(std::span<const PlacedShell> shells, const TriangleTree& tree, double slack)
      : tree_(tree), slack_(slack) {
    const std::size_t count = tree.triangles().size();
    normals_.reserve(count);
    for (const CornerTriangle& t : tree.triangles()) normals_.push_back(normal_of(t));
    place_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) place_[tree.given()[i]] = i;
    corners_.reserve(count);
    std::uint32_t vertices = 0, triangles = 0;
    for (const PlacedShell& shell : shells) {
      for (const auto& t : shell.surface->triangles)
        corners_.push_back({vertices + t[0], vertices + t[1], vertices + t[2]});
      for (const auto& t : shell.surface->across)
        across_.push_back({triangles + t[0], triangles + t[1], triangles + t[2]});
      vertices += static_cast<std::uint32_t>(shell.surface->vertices.size());
      triangles += static_cast<std::uint32_t>(shell.surface->triangles.size());
    }
  }

  /// nullopt: all triangles are, as they stand.
  std::optional<std::vector<CornerTriangle>> find() {
    const std::size_t count = tree_.triangles().size();
    std::vector<char> seen(count, 0);  // in the order given
    bool whole = true;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::vector<std::uint32_t> cutters = cutters_of(i);
      if (cutters.empty()) continue;
      seen[tree_.given()[i]] = 1;
      const std::size_t before = pieces_.size();
      cut(tree_.triangles()[i], i, cutters, 0);
      whole &= pieces_.size() == before + 1 && pieces_.back() == tree_.triangles()[i];
    }
    // Triangles that nothing meets, and that are neighbours, are surface together.
    std::vector<std::uint32_t> region;
    for (std::uint32_t first = 0; first < count; ++first) {
      if (seen[first] != 0) continue;
      region = {first};
      seen[first] = 1;
      std::uint32_t largest = first;
      double most = 0;
      for (std::size_t k = 0; k < region.size(); ++k) {
        const Vec3 twice = twice_area(triangle(region[k]));
        if (const double size = glm::dot(twice, twice); size > most) {
          most = size;
          largest = region[k];
        }
        for (const std::uint32_t next : across_[region[k]]) {
          if (seen[next] != 0) continue;
          seen[next] = 1;
          region.push_back(next);
        }
      }
      const CornerTriangle& judged = triangle(largest);
      const bool surface = is_exposed((judged[0] + judged[1] + judged[2]) / 3.0, normal_of(judged));
      whole &= surface;
      if (!surface) continue;
      for (const std::uint32_t t : region) pieces_.push_back(triangle(t));
    }
    if (whole) return std::nullopt;
    return std::move(pieces_);
  }

 private:
  const CornerTriangle& triangle(std::uint32_t given) const {
    return tree_.triangles()[place_[given]];
  }

  /// The triangles that pass through this one, touch it or cover it, other than at its corners.
  std::vector<std::uint32_t> cutters_of(std::uint32_t i) const {
    std::vector<std::uint32_t> out;
    const CornerTriangle& t = tree_.triangles()[i];
    const auto& own = corners_[tree_.given()[i]];
    const Vec3 low = glm::min(t[0], glm::min(t[1], t[2])) - slack_;
    const Vec3 high = glm::max(t[0], glm::max(t[1], t[2])) + slack_;
    tree_.for_each_near({low, high}, [&](std::uint32_t k) {
      if (k == i) return true;
      const auto& other = corners_[tree_.given()[k]];
      for (const std::uint32_t v : own) {
        if (v == other[0] || v == other[1] || v == other[2]) return true;
      }
      if (meet(t, normals_[i], tree_.triangles()[k], normals_[k])) out.push_back(k);
      return true;
    });
    return out;
  }

  /// Separating axes: the two normals, and the cross products of sides.
  bool meet(const CornerTriangle& a, const Vec3& of_a, const CornerTriangle& b,
            const Vec3& of_b) const {
    const auto apart = [&](const Vec3& axis) {
      double low_a = HUGE_VAL, high_a = -HUGE_VAL, low_b = HUGE_VAL, high_b = -HUGE_VAL;
      for (std::size_t k = 0; k < 3; ++k) {
        const double at_a = glm::dot(axis, a[k] - a[0]), at_b = glm::dot(axis, b[k] - a[0]);
        low_a = std::min(low_a, at_a);
        high_a = std::max(high_a, at_a);
        low_b = std::min(low_b, at_b);
        high_b = std::max(high_b, at_b);
      }
      return low_a > high_b + slack_ || low_b > high_a + slack_;
    };
    if (apart(of_a) || apart(of_b)) return false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 side_a = a[(k + 1) % 3] - a[k];
      if (const Vec3 across = glm::cross(of_a, side_a);
          across != Vec3(0) && apart(glm::normalize(across)))
        return false;
      for (std::size_t m = 0; m < 3; ++m) {
        const Vec3 axis = glm::cross(side_a, b[(m + 1) % 3] - b[m]);
        const double length = glm::length(axis);
        if (length > kLevel * glm::length(side_a) * glm::length(b[(m + 1) % 3] - b[m]) &&
            apart(axis / length))
          return false;
      }
    }
    return true;
  }

  /// Cuts a piece of triangle i by the planes of those that meet it, from the given one on.
  void cut(const CornerTriangle& piece, std::uint32_t i, const std::vector<std::uint32_t>& cutters,
           std::size_t from) {
    const Vec3 twice = twice_area(piece);
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, glm::length(piece[(k + 1) % 3] - piece[k]));
    if (!(glm::length(twice) > 2 * slack_ * longest)) return;  // its neighbours are as near
    for (std::size_t c = from; c < cutters.size(); ++c) {
      const CornerTriangle& other = tree_.triangles()[cutters[c]];
      const Vec3& normal = normals_[cutters[c]];
      // One in the same plane ends where others, which are not, touch it.
      if (glm::length(glm::cross(normal, normals_[i])) <= kLevel) continue;
      std::array<double, 3> height{};
      for (std::size_t k = 0; k < 3; ++k) {
        height[k] = glm::dot(normal, piece[k] - other[0]);
        if (std::abs(height[k]) <= slack_) height[k] = 0;
      }
      const auto [least, most] = std::ranges::minmax(height);
      if (least >= 0 || most <= 0 || !meet(piece, normals_[i], other, normal)) continue;
      // The corner alone on its side, or one on the plane, comes first.
      std::size_t k = 0;
      while (k < 2 && !(height[k] == 0) &&
             !((height[k] > 0) != (height[(k + 1) % 3] > 0) &&
               (height[k] > 0) != (height[(k + 2) % 3] > 0)))
        ++k;
      const Vec3 &p = piece[k], &q = piece[(k + 1) % 3], &r = piece[(k + 2) % 3];
      const double hp = height[k], hq = height[(k + 1) % 3], hr = height[(k + 2) % 3];
      if (hp == 0) {
        const Vec3 on = q + hq / (hq - hr) * (r - q);
        cut({p, q, on}, i, cutters, c + 1);
        cut({p, on, r}, i, cutters, c + 1);
        return;
      }
      const Vec3 on_q = p + hp / (hp - hq) * (q - p), on_r = p + hp / (hp - hr) * (r - p);
      cut({p, on_q, on_r}, i, cutters, c + 1);
      cut({on_q, q, r}, i, cutters, c + 1);
      cut({on_q, r, on_r}, i, cutters, c + 1);
      return;
    }
    if (is_exposed((piece[0] + piece[1] + piece[2]) / 3.0, normals_[i])) pieces_.push_back(piece);
  }

  bool is_exposed(const Vec3& place, const Vec3& normal) const {
    return tree_.winding(place + slack_ * normal) <= 0;
  }

  static constexpr double kLevel = 1e-6;  // sine of an angle: the planes are one within the slack

  const TriangleTree& tree_;
  double slack_;
  std::vector<Vec3> normals_;                          // as in the tree
  std::vector<std::uint32_t> place_;                   // in the tree, of each as given
  std::vector<std::array<std::uint32_t, 3>> corners_;  // as given
  std::vector<std::array<std::uint32_t, 3>> across_;   // as given
  std::vector<CornerTriangle> pieces_;
};

}  // namespace

SolidDepth::SolidDepth(std::span<const PlacedShell> shells) : all_(corners_of_shells(shells)) {
  slack_ = slack_of(shells, all_);
  if (auto pieces = ExposedPieces(shells, all_, slack_).find()) exposed_.emplace(*pieces);
}

SolidDepth::Depth SolidDepth::at(const Vec3& point, const Known* near) const {
  double within = std::numeric_limits<double>::infinity();
  bool inside = false, known = false;
  if (near != nullptr) {
    const double apart = glm::distance(point, near->place);
    within = (std::abs(near->depth) + apart) * (1 + 1e-9);  // so that rounding loses nothing
    known = apart < std::abs(near->depth);
    inside = near->depth > 0;
  }
  TriangleTree::Nearest nearest = tree().nearest(point, within);
  if (!(nearest.distance < HUGE_VAL)) nearest = tree().nearest(point);
  if (!known) inside = all_.winding(point) > 0;
  Depth out{inside ? nearest.distance : -nearest.distance, Vec3(0)};
  // Beside a face the way is that of its normal, to rounding.
  const Vec3 normal = normal_of(tree().triangles()[nearest.triangle]);
  if (nearest.distance > slack_)
    out.inwards = (inside ? 1.0 : -1.0) * (point - nearest.point) / nearest.distance;
  if (nearest.distance <= slack_ || glm::dot(out.inwards, normal) < -1 + 1e-12)
    out.inwards = -normal;
  return out;
}

bool SolidDepth::plane_in(const Vec3& centre, double radius) const {
  const TriangleTree::Nearest nearest = tree().nearest(centre);
  const CornerTriangle& face = tree().triangles()[nearest.triangle];
  const Vec3 normal = normal_of(face);
  // What may be nearest to a point of the ball. If all of it is in one plane, so is the border of
  // the face, which others share: it is out of reach.
  const double reach = nearest.distance + 2 * radius;
  return tree().for_each_near({centre - reach, centre + reach}, [&](std::uint32_t i) {
    const CornerTriangle& t = tree().triangles()[i];
    bool in_plane = true;
    for (const Vec3& corner : t) in_plane &= std::abs(glm::dot(normal, corner - face[0])) <= slack_;
    if (in_plane && glm::dot(normal_of(t), normal) > 0) return true;
    return glm::distance(nearest_on_triangle(t, centre), centre) > reach;
  });
}

}  // namespace palpate::stimuli
