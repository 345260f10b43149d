#include "analysis/movement/coverage.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>

#include "data/base/random.h"

namespace palpate::analysis {

std::vector<Vec3> draw_places(const std::vector<SurfaceTriangle>& surface, std::size_t count) {
  constexpr std::uint64_t kSeed = 2000;
  std::vector<double> until;
  double area = 0;
  for (const SurfaceTriangle& t : surface) {
    area += glm::length(glm::cross(t[1] - t[0], t[2] - t[0])) / 2;
    until.push_back(area);
  }
  if (!(area > 0)) throw std::invalid_argument("a surface without area has no places");
  Random random(kSeed);
  std::vector<Vec3> places;
  places.reserve(count);
  while (places.size() < count) {
    const auto at = std::upper_bound(until.begin(), until.end(), random.unit() * area);
    const SurfaceTriangle& t = surface[static_cast<std::size_t>(
        std::min<std::ptrdiff_t>(at - until.begin(), std::ssize(until) - 1))];
    // Fold the square along its diagonal.
    double u = random.unit(), v = random.unit();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    places.push_back(t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]));
  }
  return places;
}

TouchedSurface::TouchedSurface(std::vector<Vec3> places) : places_(std::move(places)) {
  if (places_.size() < kParts) throw std::invalid_argument("too few places for the parts");
  std::vector<Vec3> sorted = places_;
  divide(sorted, 0, sorted.size(), 1);
  Vec3 top = places_.front();
  corner_ = top;
  for (const Vec3& place : places_) {
    corner_ = glm::min(corner_, place);
    top = glm::max(top, place);
  }
  // At most 40 cells per side, for objects of any size.
  for (int k = 0; k < 3; ++k) cell_ = std::max(cell_, (top[k] - corner_[k]) / 40);
  for (int k = 0; k < 3; ++k)
    cells_[static_cast<std::size_t>(k)] =
        static_cast<std::int64_t>(std::floor((top[k] - corner_[k]) / cell_)) + 1;
  grid_.resize(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]));
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    const auto c = cell_of(places_[i]);
    grid_[static_cast<std::size_t>((c[2] * cells_[1] + c[1]) * cells_[0] + c[0])].push_back(i);
  }
}

void TouchedSurface::divide(std::vector<Vec3>& places, std::size_t begin, std::size_t end,
                            std::size_t node) {
  if (node >= kParts) return;
  Vec3 low = places[begin], high = low;
  for (std::size_t i = begin; i < end; ++i) {
    low = glm::min(low, places[i]);
    high = glm::max(high, places[i]);
  }
  const Vec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto at = [&](std::size_t i) { return places.begin() + static_cast<std::ptrdiff_t>(i); };
  std::sort(at(begin), at(end), [axis](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; });
  const std::size_t middle = begin + (end - begin) / 2;
  splits_[node] = {axis, (places[middle - 1][axis] + places[middle][axis]) / 2};
  divide(places, begin, middle, 2 * node);
  divide(places, middle, end, 2 * node + 1);
}

std::size_t TouchedSurface::part_of(const Vec3& point) const {
  std::size_t node = 1;
  while (node < kParts) node = 2 * node + (point[splits_[node].axis] < splits_[node].at ? 0 : 1);
  return node - kParts;
}

std::array<std::int64_t, 3> TouchedSurface::cell_of(const Vec3& point) const {
  std::array<std::int64_t, 3> cell{};
  for (int k = 0; k < 3; ++k)
    cell[static_cast<std::size_t>(k)] =
        static_cast<std::int64_t>(std::floor((point[k] - corner_[k]) / cell_));
  return cell;
}

std::vector<double> TouchedSurface::coverage(const std::vector<Vec3>& points) const {
  std::vector<std::vector<std::uint32_t>> left = grid_;
  std::vector<double> shares;
  shares.reserve(points.size());
  std::size_t touched = 0;
  for (const Vec3& point : points) {
    const auto c = cell_of(point);
    const auto range = [&](std::size_t k) {
      return std::pair(std::max<std::int64_t>(0, c[k] - 1),
                       std::min<std::int64_t>(cells_[k] - 1, c[k] + 1));
    };
    const auto [x0, x1] = range(0);
    const auto [y0, y1] = range(1);
    const auto [z0, z1] = range(2);
    for (std::int64_t z = z0; z <= z1; ++z) {
      for (std::int64_t y = y0; y <= y1; ++y) {
        for (std::int64_t x = x0; x <= x1; ++x) {
          touched +=
              std::erase_if(left[static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x)],
                            [&](std::uint32_t i) {
                              const Vec3 off = places_[i] - point;
                              return glm::dot(off, off) <= kReach * kReach;
                            });
        }
      }
    }
    shares.push_back(static_cast<double>(touched) / static_cast<double>(places_.size()));
  }
  return shares;
}

std::optional<double> entropy(const std::vector<std::size_t>& parts) {
  if (parts.empty()) return std::nullopt;
  std::array<std::size_t, TouchedSurface::kParts> counts{};
  for (const std::size_t part : parts) ++counts.at(part);
  const double n = static_cast<double>(parts.size());
  double bits = 0;
  std::size_t found = 0;
  for (const std::size_t count : counts) {
    if (count == 0) continue;
    ++found;
    const double p = static_cast<double>(count) / n;
    bits -= p * std::log2(p);
  }
  bits += static_cast<double>(found - 1) / (2 * n * std::numbers::ln2);
  return std::min(1.0, bits / std::log2(static_cast<double>(TouchedSurface::kParts)));
}

std::size_t transitions(const std::vector<std::size_t>& parts) {
  std::size_t changes = 0;
  for (std::size_t i = 1; i < parts.size(); ++i) changes += parts[i] != parts[i - 1];
  return changes;
}

}  // namespace palpate::analysis
