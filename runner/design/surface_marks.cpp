#include "runner/design/surface_marks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <optional>

#include "data/base/random.h"

namespace palpate::runner::design {
namespace {

constexpr double kMostLines = 3000;
constexpr std::size_t kTries = 6000;    // places of which those on crests get a dot
constexpr double kCrest = 0.25;         // of the depth: what is less deep is a crest
constexpr std::uint64_t kMarkSeed = 1;  // the same dots in every picture

using Corners = std::array<Vec3, 3>;

/// The part of a triangle on which a linear function, given at its corners, has a value.
std::optional<std::array<Vec3, 2>> cut(const Corners& corners, const std::array<double, 3>& at,
                                       double value) {
  std::array<Vec3, 2> ends{};
  std::size_t found = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    // A corner on the line belongs to the side above it, so that it is met once.
    if ((at[i] < value) == (at[j] < value)) continue;
    const double share = (value - at[i]) / (at[j] - at[i]);
    ends[found++] = corners[i] + share * (corners[j] - corners[i]);
  }
  if (found < 2) return std::nullopt;
  return ends;
}

/// Ridges in parallel planes.
void add_parallel(const stimuli::Texture& texture, const std::vector<Corners>& triangles,
                  SurfaceMarks& out) {
  double lines = 0;
  std::vector<std::array<double, 3>> cycles;
  for (const Corners& one : triangles) {
    cycles.push_back({texture.cycles(one[0]), texture.cycles(one[1]), texture.cycles(one[2])});
    const auto [low, high] = std::ranges::minmax(cycles.back());
    lines += std::floor(high) - std::ceil(low) + 1;
  }
  out.every = std::max(1, static_cast<int>(std::ceil(lines / kMostLines)));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto [low, high] = std::ranges::minmax(cycles[i]);
    for (double ridge = out.every * std::ceil(low / out.every); ridge <= high; ridge += out.every) {
      if (const auto line = cut(triangles[i], cycles[i], ridge)) out.lines.push_back(*line);
    }
  }
}

/// Ridges in half planes that meet in +z.
void add_meridians(const stimuli::ObjectSpec& object, const stimuli::Texture& texture,
                   const std::vector<Corners>& triangles, SurfaceMarks& out) {
  const int ridges =
      static_cast<int>(std::lround(stimuli::kFullTurn * object.radius / texture.period()));
  const double phase = object.texture->phase / 360;
  const double lines =
      static_cast<double>(ridges) * std::sqrt(static_cast<double>(triangles.size()));
  out.every = std::max(1, static_cast<int>(std::ceil(lines / kMostLines)));
  for (int ridge = 0; ridge < ridges; ridge += out.every) {
    const double turn = stimuli::kFullTurn * (ridge - phase) / ridges;
    const Vec3 along(std::cos(turn), std::sin(turn), 0), across(-along.y, along.x, 0);
    for (const Corners& one : triangles) {
      const auto line = cut(
          one, {glm::dot(across, one[0]), glm::dot(across, one[1]), glm::dot(across, one[2])}, 0);
      if (line && glm::dot(along, (*line)[0] + (*line)[1]) > 0) out.lines.push_back(*line);
    }
  }
}

/// Places drawn evenly over the surface, of which those on crests stay.
void add_dots(const stimuli::Texture& texture, const std::vector<Corners>& triangles,
              SurfaceMarks& out) {
  std::vector<double> areas;
  areas.reserve(triangles.size());
  double all = 0;
  for (const Corners& one : triangles)
    areas.push_back(all += glm::length(glm::cross(one[1] - one[0], one[2] - one[0])));
  if (!(all > 0)) return;
  Random random(kMarkSeed);
  for (std::size_t i = 0; i < kTries; ++i) {
    const auto at = std::ranges::lower_bound(areas, random.unit() * all) - areas.begin();
    const Corners& one = triangles[std::min(static_cast<std::size_t>(at), triangles.size() - 1)];
    double a = random.unit(), b = random.unit();
    if (a + b > 1) a = 1 - a, b = 1 - b;
    const Vec3 first = one[1] - one[0], second = one[2] - one[0];
    const Vec3 place = one[0] + a * first + b * second;
    if (texture.mean_height(place, Vec3(0), first, second).height > -kCrest * texture.depth())
      out.dots.push_back(place);
  }
}

}  // namespace

SurfaceMarks surface_marks(const stimuli::ObjectSpec& object, const stimuli::Texture& texture,
                           const std::vector<Vec3>& corners,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  SurfaceMarks out;
  if (!(texture.depth() > 0)) return out;
  std::vector<Corners> all;
  all.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) all.push_back({corners[a], corners[b], corners[c]});
  const bool ridges = object.texture->kind == stimuli::TextureSpec::Kind::sine ||
                      object.texture->kind == stimuli::TextureSpec::Kind::trapezoid;
  if (ridges && object.texture->around) {
    add_meridians(object, texture, all, out);
  } else if (ridges) {
    add_parallel(texture, all, out);
  } else {
    add_dots(texture, all, out);
  }
  return out;
}

}  // namespace palpate::runner::design
