#include "runner/evidence/verification/union_walks.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <span>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kGrid = 0.01;  // m

/// Along the axes, exactly in the planes of boxes: no turning.
std::vector<OraclePose> aligned_path(Random& random, const OracleParts& parts, std::size_t ticks) {
  const Mat3 turns[] = {Mat3(1), Mat3(Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 0, 0)),
                        Mat3(Vec3(0, 0, -1), Vec3(0, 1, 0), Vec3(1, 0, 0)),
                        Mat3(Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, -1))};
  OraclePose at{Vec3(-0.5), turns[random.below(std::size(turns))]};
  std::vector<OraclePose> path{at};
  while (path.size() < ticks) {
    const auto& vertices = parts[random.below(parts.size())].mesh->vertices();
    const Vec3 corner = vertices[random.below(vertices.size())];
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(random.below(3));
      const double to = corner[axis] + (random.below(2) == 0 ? 0 : 0.02 * (random.unit() - 0.5));
      const double from = at.tip[axis];
      const int steps = path.size() == 1 ? 1 : static_cast<int>(1 + random.below(60));
      for (int step = 1; step <= steps && path.size() < ticks; ++step) {
        at.tip[axis] = step == steps ? to : from + step * (to - from) / steps;
        path.push_back(at);
      }
    }
  }
  return path;
}

/// Takes numbers from bytes; 0 once all are used.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool any() const { return at_ < bytes_.size(); }
  int below(int bound) { return any() ? bytes_[at_++] % bound : 0; }
  Vec3 grid_point(int reach) {
    const int x = below(2 * reach + 1), y = below(2 * reach + 1), z = below(2 * reach + 1);
    return kGrid * Vec3(x - reach, y - reach, z - reach);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

OraclePart grid_part(Bytes& bytes) {
  stimuli::PolygonSoup soup = stimuli::cube(1);
  const Vec3 low = bytes.grid_point(3);
  Vec3 size;
  for (int k = 2; k >= 0; --k) size[k] = kGrid * (1 + bytes.below(4));
  for (Vec3& v : soup.vertices) v = low + (v + Vec3(0.5)) * size;
  if (bytes.below(3) == 0) {  // shift its upper side along x: slopes
    for (Vec3& v : soup.vertices) {
      if (v.z > low.z + 0.5 * size.z) v.x += kGrid;
    }
  }
  return part_of(soup);
}

}  // namespace

UnionWalk random_union_walk(std::uint64_t seed, std::uint64_t walk, std::size_t ticks) {
  Random random(seed, {walk, 0x756e});
  const auto kind = random.below(8);
  if (kind == 0) {
    std::vector<std::uint8_t> bytes(400);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
    return grid_walk(bytes, ticks);
  }
  UnionWalk drawn;
  drawn.parts = random_cluster(random, 3 + static_cast<int>(random.below(6)));
  drawn.tool = random_tool(random, 1 + static_cast<int>(walk % 3));
  const double speeds[] = {1e-4, 3e-4, 1e-3, 5e-3};  // m a tick: 0.1 to 5 m/s at 1 kHz
  const double speed = speeds[random.below(std::size(speeds))];
  drawn.coincident = kind == 1;
  drawn.path = kind == 1 ? aligned_path(random, drawn.parts, ticks)
                         : random_tool_path(random, drawn.parts, drawn.tool, speed, ticks);
  return drawn;
}

UnionWalk grid_walk(std::span<const std::uint8_t> data, std::size_t most_ticks) {
  Bytes bytes(data);
  UnionWalk walk;
  walk.coincident = true;
  const int parts = 2 + bytes.below(6), segments = 1 + bytes.below(3);
  for (int i = 0; i < parts; ++i) walk.parts.push_back(grid_part(bytes));
  walk.tool.push_back({Vec3(0), Vec3(0, 0, kGrid * (2 + bytes.below(8)))});
  while (static_cast<int>(walk.tool.size()) < segments) {
    const Vec3 from = bytes.grid_point(2), to = bytes.grid_point(2);
    walk.tool.push_back({from, from == to ? from + Vec3(kGrid, 0, 0) : to});
  }
  // Starts far above; the tip moves along the axes from one multiple of 5 mm to another, in steps
  // of whole millimetres.
  std::array<int, 3> place{0, 0, 300};  // mm
  Quat turned(1, 0, 0, 0);
  const auto add = [&] {
    if (walk.path.size() >= most_ticks) return;
    walk.path.push_back({1e-3 * Vec3(place[0], place[1], place[2]), glm::mat3_cast(turned)});
  };
  add();
  place[2] = 60;
  while (bytes.any() && walk.path.size() < most_ticks) {
    const auto axis = static_cast<std::size_t>(bytes.below(3));
    if (bytes.below(4) == 0) {
      const int steps = 1 + bytes.below(30);
      const double angle = std::numbers::pi / 4 * (bytes.below(5) - 2) / steps;
      Vec3 about(0);
      about[static_cast<int>(axis)] = 1;
      for (int i = 0; i < steps; ++i) {
        turned = glm::normalize(glm::angleAxis(angle, about) * turned);
        add();
      }
    } else {
      const int to = 5 * (bytes.below(15) - 7), step = 1 + bytes.below(4);
      while (place[axis] != to) {
        place[axis] += std::clamp(to - place[axis], -step, step);
        add();
      }
    }
  }
  return walk;
}

bool is_plain(const OracleTool& tool) { return tool.size() == 1; }

}  // namespace palpate::runner::evidence
