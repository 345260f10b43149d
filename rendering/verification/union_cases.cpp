#include "rendering/verification/union_cases.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <utility>

#include "rendering/verification/random_solids.h"
#include "stimuli/orientation.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

// Compilers choose the order of a call's arguments: make every draw a statement of its own, so that
// a walk is the same everywhere.

Vec3 vector_between(Random& random, double low, double high) {
  Vec3 drawn;
  for (int k = 2; k >= 0; --k) drawn[k] = between(random, low, high);
  return drawn;
}

constexpr double kClear = 2e-3;  // m, off the object at the start of a path

struct Corner {
  double x, z;
};

/// \param outline  convex, counter-clockwise seen from -y
stimuli::PolygonSoup prism(const std::vector<Corner>& outline, double low_y, double high_y) {
  stimuli::PolygonSoup soup;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double y : {low_y, high_y}) {
    for (const Corner& corner : outline) soup.vertices.emplace_back(corner.x, y, corner.z);
  }
  std::vector<std::uint32_t> front, back;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    front.push_back(i);
    back.push_back(2 * n - 1 - i);
    soup.faces.push_back({i, n + i, n + next, next});
  }
  soup.faces.push_back(std::move(front));
  soup.faces.push_back(std::move(back));
  return soup;
}

Vec3 right_wall(double opening) { return {-std::cos(opening / 2), 0, std::sin(opening / 2)}; }

stimuli::PolygonSoup random_convex(Random& random) {
  switch (random.below(6)) {
    case 0:
      return stimuli::icosphere(0.5, static_cast<int>(random.below(2)));
    case 1: {
      const auto sides = static_cast<int>(3 + random.below(9));
      return stimuli::cone(0.5, between(random, 0.6, 1.5), sides);
    }
    case 2: {
      const auto sides = static_cast<int>(3 + random.below(9));
      return stimuli::cylinder(0.5, between(random, 0.6, 1.5), sides);
    }
    default:
      return stimuli::cube(1);
  }
}

}  // namespace

OraclePart part_of(const stimuli::PolygonSoup& soup) {
  return {std::make_shared<const stimuli::ConvexMesh>(soup), Pose{}};
}

OraclePart box_part(const Vec3& low, const Vec3& high) {
  stimuli::PolygonSoup soup = stimuli::cube(1);
  for (Vec3& v : soup.vertices) v = 0.5 * (low + high) + v * (high - low);
  return part_of(soup);
}

OracleParts groove(double opening) {
  constexpr double kWall = 0.06, kShoulder = 0.05, kBelow = -0.04, kHalfLength = 0.1;
  const double x = kWall * std::sin(opening / 2), z = kWall * std::cos(opening / 2);
  std::vector<Corner> right{
      {0, 0}, {0, kBelow}, {x + kShoulder, kBelow}, {x + kShoulder, z}, {x, z}};
  std::vector<Corner> left;
  left.reserve(right.size());
  for (const Corner& corner : right) left.push_back({-corner.x, corner.z});
  std::reverse(left.begin(), left.end());
  return {part_of(prism(right, -kHalfLength, kHalfLength)),
          part_of(prism(left, -kHalfLength, kHalfLength))};
}

Vec3 groove_displacement(double opening, const Vec3& virtual_tip) {
  const Vec3 right = right_wall(opening), left(-right.x, 0, right.z);
  const double below_right = -glm::dot(right, virtual_tip);
  const double below_left = -glm::dot(left, virtual_tip);
  const double c = glm::dot(left, right);
  // On one wall alone, if the other one is not in the way there.
  if (below_right > 0 && below_left <= c * below_right) return below_right * right;
  if (below_left > 0 && below_right <= c * below_left) return below_left * left;
  if (below_right <= 0 && below_left <= 0) return Vec3(0);
  return {-virtual_tip.x, 0, -virtual_tip.z};
}

OracleParts stairs(int steps, double width, double height) {
  constexpr double kHalfLength = 0.1;
  OracleParts parts;
  for (int i = 0; i < steps; ++i) {
    parts.push_back(box_part({i == 0 ? -0.1 : width * (i - 1), -kHalfLength, -0.1 - height * steps},
                             {width * i, kHalfLength, -height * i}));
  }
  return parts;
}

OracleParts cut_to_pieces(const stimuli::PolygonSoup& solid, int cuts, Random& random) {
  std::vector<stimuli::PolygonSoup> pieces{solid};
  for (int i = 0; i < cuts; ++i) {
    std::vector<stimuli::PolygonSoup> smaller;
    for (const stimuli::PolygonSoup& piece : pieces) {
      Vec3 middle;
      for (const Vec3& v : piece.vertices) middle += v;
      middle /= static_cast<double>(piece.vertices.size());
      const Vec3 normal = random_direction(random);
      const double offset = glm::dot(normal, middle);
      smaller.push_back(part_below(piece, normal, offset));
      smaller.push_back(part_below(piece, -normal, -offset));
    }
    pieces = std::move(smaller);
  }
  OracleParts parts;
  for (const stimuli::PolygonSoup& piece : pieces) parts.push_back(part_of(piece));
  return parts;
}

OracleParts random_cluster(Random& random, int parts) {
  OracleParts cluster;
  Vec3 corner(-0.02);  // of the next box, which abuts the previous one
  while (static_cast<int>(cluster.size()) < parts) {
    if (random.below(3) == 0) {
      const Vec3 size = vector_between(random, 0.01, 0.03);
      cluster.push_back(box_part(corner, corner + size));
      const auto axis = static_cast<int>(random.below(3));
      corner[axis] += size[axis];
      continue;
    }
    const Quat turn = random.below(4) == 0 ? Quat(1, 0, 0, 0) : stimuli::uniform_rotation(random);
    const Vec3 factors = vector_between(random, 0.4, 1);
    const Vec3 direction = random_direction(random);
    const Vec3 place = between(random, 0, 0.025) * direction;
    const double size = between(random, 0.02, 0.05);
    const stimuli::PolygonSoup solid = stretched(random_convex(random), factors);
    cluster.push_back(part_of(turned_and_moved(solid, turn, size, place)));
  }
  return cluster;
}

OracleTool random_tool(Random& random, int segments) {
  OracleTool tool{{Vec3(0), Vec3(0, 0, between(random, 0.02, 0.12))}};
  while (static_cast<int>(tool.size()) < segments) {
    const OracleSegment& at = tool[random.below(tool.size())];
    const Vec3 from = random.below(2) == 0 ? at.from : at.to;
    const Vec3 direction = random_direction(random);
    tool.push_back({from, from + between(random, 0.01, 0.05) * direction});
  }
  return tool;
}

std::vector<OraclePose> random_tool_path(Random& random, const OracleParts& parts,
                                         const OracleTool& tool, double speed, std::size_t ticks) {
  double radius = 0;
  for (const OraclePart& part : parts) {
    for (const Vec3& v : part.mesh->vertices()) {
      radius = std::max(radius, glm::length(part.pose.orientation * v + part.pose.position));
    }
  }
  constexpr double kMostTurn = 0.6;  // rad from place to place
  Quat orientation = stimuli::uniform_rotation(random);
  const auto next_tip = [&](const Quat& turned) {
    const OracleSegment& segment = tool[random.below(tool.size())];
    const Vec3 led = segment.from + random.unit() * (segment.to - segment.from);
    const Vec3 direction = random_direction(random);
    return between(random, 0.3, 1.2) * radius * direction - turned * led;
  };
  // Comes in straight, from just off the object.
  const UnionOracle oracle(parts, tool);
  const Vec3 first = next_tip(orientation);
  const Vec3 outwards = random_direction(random);
  OraclePose at{first, glm::mat3_cast(orientation)};
  while (oracle.depth(at) > -kClear) at.tip += kClear * outwards;
  std::vector<OraclePose> path{at};
  const auto lead_to = [&](const Vec3& next, const Quat& turned) {
    const Vec3 from = at.tip;
    const double steps = std::ceil(std::max(1.0, glm::length(next - from) / speed));
    for (double step = 1; step <= steps && path.size() < ticks; ++step) {
      path.push_back({from + step / steps * (next - from),
                      glm::mat3_cast(glm::slerp(orientation, turned, step / steps))});
    }
    at = path.back();
    orientation = turned;
  };
  lead_to(first, orientation);
  while (path.size() < ticks) {
    const Vec3 axis = random_direction(random);
    const Quat turned =
        glm::normalize(glm::angleAxis(between(random, 0, kMostTurn), axis) * orientation);
    lead_to(next_tip(turned), turned);
  }
  return path;
}

}  // namespace palpate::rendering
