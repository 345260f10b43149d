#include "stimuli/flat_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <utility>

namespace palpate::stimuli {
namespace {

constexpr std::size_t kLeastOfFace = 64;  // triangles
constexpr double kGrowing = 0.8;          // of the tolerance; the last fit may be farther off

/// Grows plane faces from one triangle to its neighbours.
class FlatFaceSearch {
 public:
  FlatFaceSearch(const ClosedSurface& surface, double tolerance)
      : surface_(surface), tolerance_(tolerance), face_(surface.triangles.size(), kNoFlatFace) {}

  std::vector<std::uint32_t> run() {
    std::uint32_t faces = 0;
    for (std::uint32_t first = 0; first < face_.size(); ++first) {
      if (face_[first] != kNoFlatFace || area(first) == Vec3(0)) continue;
      grow(first, faces);
      if (region_.size() >= kLeastOfFace && is_plane()) {
        ++faces;
      } else {
        for (const std::uint32_t t : region_) face_[t] = kNoFlatFace;
      }
    }
    if (faces == 0) return {};
    return std::move(face_);
  }

 private:
  const Vec3& corner(std::uint32_t t, std::size_t k) const {
    return surface_.vertices[surface_.triangles[t][k]];
  }
  Vec3 area(std::uint32_t t) const {
    return glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
  }

  // Rounding tilts the plane of a sliver. That of the triangles so far tells which ones are next to
  // them, so it is fitted again whenever they are twice as many.
  void grow(std::uint32_t first, std::uint32_t face) {
    region_.clear();
    beside_.clear();
    areas_ = middles_ = Vec3(0);
    add(first, face);
    fit();
    std::size_t fitted = 1, next = 0;
    for (;;) {
      for (; next < region_.size() && region_.size() < 2 * fitted; ++next) {
        for (const std::uint32_t t : surface_.across[region_[next]]) {
          if (face_[t] != kNoFlatFace) continue;
          if (is_within(t, kGrowing * tolerance_)) {
            add(t, face);
          } else {
            beside_.push_back(t);
          }
        }
      }
      if (region_.size() == fitted) return;
      fit();
      fitted = region_.size();
      std::erase_if(beside_, [&](std::uint32_t t) {
        if (face_[t] == kNoFlatFace && is_within(t, kGrowing * tolerance_)) add(t, face);
        return face_[t] != kNoFlatFace;
      });
    }
  }

  void add(std::uint32_t t, std::uint32_t face) {
    face_[t] = face;
    region_.push_back(t);
    areas_ += area(t);
    for (std::size_t k = 0; k < 3; ++k) middles_ += corner(t, k) / 3.0;
  }

  void fit() {
    normal_ = glm::normalize(areas_);
    origin_ = middles_ / static_cast<double>(region_.size());
  }

  bool is_within(std::uint32_t t, double distance) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::abs(glm::dot(normal_, corner(t, k) - origin_)) > distance) return false;
    }
    return glm::dot(area(t), normal_) > 0;
  }

  bool is_plane() {
    fit();
    return std::ranges::all_of(region_,
                               [this](std::uint32_t t) { return is_within(t, tolerance_); });
  }

  const ClosedSurface& surface_;
  const double tolerance_;
  std::vector<std::uint32_t> face_;
  std::vector<std::uint32_t> region_, beside_;  ///< triangles of the face that grows; not of it
  Vec3 areas_{0}, middles_{0};                  ///< their sums
  Vec3 normal_{0}, origin_{0};                  ///< of the plane
};

/// Exchanges diagonals.
class Recutting {
  // Least height of a new triangle, times the unevenness that rounding leaves in its face. So it is
  // tilted by less than a degree.
  static constexpr double kSlope = 64;

 public:
  explicit Recutting(ClosedSurface& surface)
      : surface_(surface), fixed_(surface.triangles.size(), 0) {
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      const std::uint32_t face = surface.flat_face[t];
      if (face == kNoFlatFace) continue;
      if (face >= normals_.size()) normals_.resize(face + 1, Vec3(0));
      const auto& c = surface.triangles[t];
      normals_[face] += glm::cross(at(c[1]) - at(c[0]), at(c[2]) - at(c[0]));
    }
    for (Vec3& normal : normals_) normal = glm::normalize(normal);
    std::vector<std::array<double, 2>> heights(normals_.size(), {HUGE_VAL, -HUGE_VAL});
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      const std::uint32_t face = surface.flat_face[t];
      if (face == kNoFlatFace) continue;
      for (const std::uint32_t corner : surface.triangles[t]) {
        const double height = glm::dot(normals_[face], at(corner));
        heights[face] = {std::min(heights[face][0], height), std::max(heights[face][1], height)};
      }
    }
    for (const auto& [lowest, highest] : heights) least_.push_back(kSlope * (highest - lowest));
    for (const std::uint32_t t : surface.at_pockets) fixed_[t] = 1;
  }

  // A triangle changes once in a round. So half of a fan's edges become chords of its rim, then
  // half of the rest.
  void run() {
    std::vector<std::uint32_t> open, next, changed(fixed_.size(), 0);
    for (std::uint32_t t = 0; t < fixed_.size(); ++t) {
      if (surface_.flat_face[t] != kNoFlatFace && fixed_[t] == 0) open.push_back(t);
    }
    for (std::uint32_t round = 1; !open.empty(); ++round) {
      next.clear();
      for (const std::uint32_t t : open) {
        for (std::uint32_t k = 0; k < 3 && changed[t] != round; ++k) {
          const std::uint32_t other = surface_.across[t][k];
          if (surface_.flat_face[other] != surface_.flat_face[t] || fixed_[other] != 0) continue;
          if (changed[other] == round) {
            next.push_back(t);
          } else if (exchange(t, k, other)) {
            changed[t] = changed[other] = round;
            next.insert(next.end(), {t, other});
          }
        }
      }
      std::ranges::sort(next);
      next.erase(std::unique(next.begin(), next.end()), next.end());
      open.swap(next);
    }
  }

 private:
  const Vec3& at(std::uint32_t vertex) const { return surface_.vertices[vertex]; }

  /// A factor of lengths, squared, that differs by chance. In a zigzag across a disk the other
  /// diagonals are as long as the edges: exchanging some of them makes shorter ones possible.
  static double preference(std::uint32_t v, std::uint32_t w) {
    constexpr double kMost = 0.05;
    const auto chance = [](std::uint32_t vertex) {
      const std::uint32_t mixed = (vertex + 1) * 0x9e3779b1U;
      return std::ldexp((mixed ^ mixed >> 15U) * 0x85ebca77U, -32);
    };
    return 1 + kMost * (chance(v) + chance(w));
  }

  /// Whether the diagonal a b of two triangles, side k of t, is now c d, which is shorter.
  bool exchange(std::uint32_t t, std::uint32_t k, std::uint32_t other) {
    constexpr double kShorter = 1 - 1e-9;  // of the length, squared
    constexpr double kNarrow = 1e-9;       // height of the length
    constexpr double kSliver = 0.25;       // the same; others stay as their file has them
    const auto left = surface_.triangles[t], right = surface_.triangles[other];
    const auto by_left = surface_.across[t], by_right = surface_.across[other];
    const std::uint32_t a = left[k], b = left[(k + 1) % 3], c = left[(k + 2) % 3];
    const std::uint32_t j = right[0] == b ? 0 : right[1] == b ? 1 : 2;
    if (right[j] != b || right[(j + 1) % 3] != a) return false;
    const std::uint32_t d = right[(j + 2) % 3];
    const Vec3 now = at(b) - at(a), then = at(d) - at(c);
    const double length2 = glm::dot(then, then);
    const double least =
        std::max(kNarrow * length2, least_[surface_.flat_face[t]] * std::sqrt(length2));
    if (c == d ||
        !(length2 * preference(c, d) < kShorter * glm::dot(now, now) * preference(a, b))) {
      return false;
    }
    const Vec3& normal = normals_[surface_.flat_face[t]];
    const auto above = [&](const Vec3& apex) {  // times the length, of a triangle on a b
      return std::abs(glm::dot(normal, glm::cross(now, apex - at(a))));
    };
    if (std::min(above(at(c)), above(at(d))) > kSliver * glm::dot(now, now)) return false;
    if (!(glm::dot(normal, glm::cross(at(a) - at(c), then)) > least) ||
        !(glm::dot(normal, glm::cross(then, at(b) - at(c))) > least)) {
      return false;
    }
    surface_.triangles[t] = {a, d, c};
    surface_.across[t] = {by_right[(j + 1) % 3], other, by_left[(k + 2) % 3]};
    surface_.triangles[other] = {d, b, c};
    surface_.across[other] = {by_right[(j + 2) % 3], by_left[(k + 1) % 3], t};
    relink(by_right[(j + 1) % 3], d, a, t);
    relink(by_left[(k + 1) % 3], c, b, other);
    return true;
  }

  // Beyond its side from one corner to another, a triangle now has this one.
  void relink(std::uint32_t triangle, std::uint32_t from, std::uint32_t to, std::uint32_t beyond) {
    const auto& corners = surface_.triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      if (corners[k] == from && corners[(k + 1) % 3] == to) surface_.across[triangle][k] = beyond;
    }
  }

  ClosedSurface& surface_;
  std::vector<Vec3> normals_;  ///< unit; of the faces
  std::vector<double> least_;  ///< m; of the faces, the height of a new triangle
  std::vector<char> fixed_;    ///< of each triangle, whether it stays
};

}  // namespace

std::vector<std::uint32_t> find_flat_faces(const ClosedSurface& surface, double tolerance) {
  return FlatFaceSearch(surface, tolerance).run();
}

void cut_flat_faces_anew(ClosedSurface& surface) {
  if (!surface.flat_face.empty()) Recutting(surface).run();
}

}  // namespace palpate::stimuli
