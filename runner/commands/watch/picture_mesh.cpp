#include "runner/commands/watch/picture_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "runner/display/scene/drawn_mesh.h"

namespace palpate::runner {
namespace {

using Cell = std::array<std::int64_t, 3>;

/// Corners of one cell of a grid become one, in their middle; triangles that collapse go.
PictureMesh clustered(const DrawnMesh& drawn, double cell) {
  PictureMesh out;
  std::map<Cell, std::uint32_t> known;
  std::vector<double> counts;
  std::set<std::array<std::uint32_t, 3>> seen;
  for (std::size_t i = 0; i + 2 < drawn.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p(drawn[i + k].position);
      const Cell at{std::llround(p.x / cell), std::llround(p.y / cell), std::llround(p.z / cell)};
      const auto [found, is_new] =
          known.try_emplace(at, static_cast<std::uint32_t>(out.corners.size()));
      if (is_new) {
        out.corners.emplace_back(0);
        counts.push_back(0);
      }
      triangle[k] = found->second;
      out.corners[triangle[k]] += p;
      ++counts[triangle[k]];
    }
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0])
      continue;
    // The same way round from its lowest corner, so that equal ones are found.
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
    if (seen.insert(triangle).second) out.triangles.push_back(triangle);
  }
  for (std::size_t i = 0; i < out.corners.size(); ++i) out.corners[i] /= counts[i];
  return out;
}

double size_of(const DrawnMesh& drawn) {
  Vec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
  for (const DrawnVertex& corner : drawn) {
    low = glm::min(low, Vec3(corner.position));
    high = glm::max(high, Vec3(corner.position));
  }
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

}  // namespace

PictureMesh picture_mesh(const stimuli::ObjectSpec& object, std::size_t most) {
  constexpr double kSame = 1e-6, kCoarser = 1.25;  // of the size
  const DrawnMesh drawn = triangles_of(object);
  const double size = size_of(drawn);
  PictureMesh mesh = clustered(drawn, kSame * size);
  const std::size_t all = mesh.triangles.size();
  // A surface of n triangles has corners some size / sqrt(n) apart.
  for (double cell = 0.5 * size / std::sqrt(static_cast<double>(most));
       mesh.triangles.size() > most; cell *= kCoarser)
    mesh = clustered(drawn, cell);
  mesh.all_triangles = all;
  return mesh;
}

}  // namespace palpate::runner
