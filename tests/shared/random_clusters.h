#pragma once
// Random clusters of convex parts, tools and paths through them.

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "rendering/scene.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/shared/union_scenes.h"

namespace palpate::testing {

inline constexpr double kClusterStiffness = 1000;  // N/m

/// Boxes, slabs and hulls that overlap at random.
inline std::vector<rendering::SceneObject> cluster(Random& random, const Pose& pose = {},
                                                   double scale = 1) {
  std::vector<rendering::SceneObject> parts;
  const std::uint64_t count = 2 + random.below(7);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto edge = [&] { return 0.01 + 0.03 * random.unit(); };
    Vec3 half = 0.5 * Vec3{edge(), edge(), edge()};
    if (random.below(4) == 0) half.z = 5e-4;  // a thin plate
    stimuli::PolygonSoup soup = random.below(4) == 0
                                    ? random_polyhedron(random, 12, Vec3(0.02, 0.015, 0.01))
                                    : box_soup(-half, half);
    for (Vec3& v : soup.vertices) v *= scale;
    const Pose at{0.02 * scale * Vec3{random.normal(), random.normal(), random.normal()},
                  stimuli::uniform_rotation(random)};
    parts.push_back(placed_object(
        mesh_of(soup),
        {pose.orientation * at.position + pose.position, pose.orientation * at.orientation},
        kClusterStiffness, 0));
  }
  return parts;
}

inline rendering::Tool random_tool(Random& random, std::size_t segments, double scale = 1) {
  rendering::Tool tool;
  for (std::size_t j = 0; j < segments; ++j) {
    const Vec3 from = j == 0 ? Vec3(0) : tool.segments.back().to;
    const Vec3 along =
        j == 0 ? Vec3(0, 0, 0.05) : 0.02 * Vec3{random.normal(), random.normal(), random.normal()};
    tool.segments.push_back({from, from + scale * along});
  }
  return tool;
}

/// Through and round a cluster; about `speed` m/s.
inline ProbePath cluster_path(Random& random, std::size_t ticks, double speed, double scale = 1) {
  const Wave3 place(random), turn(random);
  ProbePath path{{Vec3(scale, 0, 0), Vec3(scale, 0, 0.1 * scale)}};
  double travelled = 0;
  while (path.size() < ticks) {
    travelled += speed * kTick / 0.03 * (0.3 + 1.4 * random.unit());
    const Vec3 tip = 0.035 * scale * place(travelled);
    const Vec3 axis = safe_direction(Vec3(0, 0, 0.7) + turn(0.5 * travelled));
    path.push_back({tip, tip + 0.1 * scale * axis});
  }
  return path;
}

}  // namespace palpate::testing
