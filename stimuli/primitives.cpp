#include "stimuli/primitives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>

#include "stimuli/half_edges.h"
#include "stimuli/mesh_file.h"
#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

constexpr int kMaxSubdivisions = 8;  // 1,310,720 triangles
constexpr int kMaxSegments = 65536;

void require_length(double value, const char* shape, const char* name) {
  if (std::isfinite(value) && value > 0) return;
  throw std::invalid_argument(std::string(shape) + ": the " + name +
                              " must be a length above 0 m, not " + std::to_string(value));
}

void require_count(int value, int lowest, int highest, const char* shape, const char* name) {
  if (value >= lowest && value <= highest) return;
  throw std::invalid_argument(std::string(shape) + ": the number of " + name + " must be from " +
                              std::to_string(lowest) + " to " + std::to_string(highest) + ", not " +
                              std::to_string(value));
}

// Corner k of a rim at the angle 2 pi k / segments from +x. Worked out within an eighth of a turn,
// so that corners at multiples of 90 degrees are exact and mirrored ones are exact mirror images.
Vec3 rim_corner(double radius, double z, int k, int segments) {
  const std::int64_t quarters = 4 * static_cast<std::int64_t>(k);
  const std::int64_t quarter = quarters / segments, rest = quarters % segments;
  const auto angle = [&](std::int64_t part) {
    return std::numbers::pi / 2 * static_cast<double>(part) / segments;
  };
  const bool low = 2 * rest < segments;
  double c = low ? std::cos(angle(rest)) : std::sin(angle(segments - rest));
  double s = low ? std::sin(angle(rest)) : std::cos(angle(segments - rest));
  if (2 * rest == segments) c = s;  // 45 degrees
  const std::array<std::array<double, 2>, 4> turned{{{c, s}, {-s, c}, {-c, -s}, {s, -c}}};
  const auto& direction = turned[static_cast<std::size_t>(quarter)];
  return {radius * direction[0], radius * direction[1], z};
}

void add_rim(PolygonSoup& soup, double radius, double z, int segments) {
  for (int k = 0; k < segments; ++k) soup.vertices.push_back(rim_corner(radius, z, k, segments));
}

// The corners first .. first + segments, as seen from above (counter-clockwise) or from below.
std::vector<Index> rim_polygon(Index first, int segments, bool from_above) {
  std::vector<Index> polygon;
  polygon.reserve(static_cast<std::size_t>(segments));
  for (int k = 0; k < segments; ++k) {
    polygon.push_back(first + static_cast<Index>(from_above ? k : segments - 1 - k));
  }
  return polygon;
}

PolygonSoup icosahedron() {
  constexpr double g = std::numbers::phi;
  return {{{-1, g, 0},
           {1, g, 0},
           {-1, -g, 0},
           {1, -g, 0},
           {0, -1, g},
           {0, 1, g},
           {0, -1, -g},
           {0, 1, -g},
           {g, 0, -1},
           {g, 0, 1},
           {-g, 0, -1},
           {-g, 0, 1}},
          {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
           {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
           {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
}

/// m, of any coordinate: poses farther away are no hand's, and the renderers take them for faults.
constexpr double kFarthestCorner = 1e6;

void check_reach(const PolygonSoup& soup, const std::string& file) {
  MeshFaults faults;
  for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
    const Vec3& at = soup.vertices[v];
    if (std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) <= kFarthestCorner) continue;
    faults.add("too far", [&] {
      char text[120];
      std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g)", at.x, at.y, at.z);
      return file + ": " + MeshNaming(soup.names).vertex(static_cast<Index>(v), at) +
             ": expected coordinates in metres, up to 1e6 from the origin, found " + text;
    });
  }
  faults.throw_if_any();
}

}  // namespace

PolygonSoup icosphere(double radius, int subdivisions) {
  require_length(radius, "sphere", "radius");
  require_count(subdivisions, 0, kMaxSubdivisions, "sphere", "subdivisions");
  PolygonSoup soup = icosahedron();
  for (Vec3& vertex : soup.vertices) vertex = glm::normalize(vertex);
  for (int level = 0; level < subdivisions; ++level) {
    PairMap midpoints(soup.faces.size() * 3 / 2);
    const auto midpoint = [&](Index a, Index b) {
      Index& kept = midpoints(a, b);
      if (kept == PairMap::kNone) {
        kept = static_cast<Index>(soup.vertices.size());
        soup.vertices.push_back(glm::normalize(soup.vertices[a] + soup.vertices[b]));
      }
      return kept;
    };
    std::vector<std::vector<Index>> finer;
    finer.reserve(4 * soup.faces.size());
    for (const std::vector<Index>& face : soup.faces) {
      const Index a = face[0], b = face[1], c = face[2];
      const Index ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
      finer.push_back({a, ab, ca});
      finer.push_back({b, bc, ab});
      finer.push_back({c, ca, bc});
      finer.push_back({ab, bc, ca});
    }
    soup.faces = std::move(finer);
  }
  for (Vec3& vertex : soup.vertices) vertex *= radius;
  return soup;
}

PolygonSoup cone(double radius, double height, int segments) {
  require_length(radius, "cone", "radius");
  require_length(height, "cone", "height");
  require_count(segments, 3, kMaxSegments, "cone", "segments");
  PolygonSoup soup;
  add_rim(soup, radius, -height / 2, segments);
  soup.vertices.emplace_back(0, 0, height / 2);
  const auto count = static_cast<Index>(segments);
  for (Index k = 0; k < count; ++k) soup.faces.push_back({k, (k + 1) % count, count});
  soup.faces.push_back(rim_polygon(0, segments, false));
  return soup;
}

PolygonSoup cylinder(double radius, double height, int segments) {
  require_length(radius, "cylinder", "radius");
  require_length(height, "cylinder", "height");
  require_count(segments, 3, kMaxSegments, "cylinder", "segments");
  PolygonSoup soup;
  add_rim(soup, radius, -height / 2, segments);
  add_rim(soup, radius, height / 2, segments);
  const auto count = static_cast<Index>(segments);
  for (Index k = 0; k < count; ++k) {
    const Index next = (k + 1) % count;
    soup.faces.push_back({k, next, count + next, count + k});
  }
  soup.faces.push_back(rim_polygon(0, segments, false));
  soup.faces.push_back(rim_polygon(count, segments, true));
  return soup;
}

PolygonSoup cube(double edge) {
  require_length(edge, "cube", "edge");
  return box(Vec3(edge));
}

PolygonSoup box(const Vec3& size) {
  for (int axis = 0; axis < 3; ++axis) require_length(size[axis], "box", "size");
  const Vec3 h = size / 2.0;
  return {{{-h.x, -h.y, -h.z},
           {h.x, -h.y, -h.z},
           {h.x, h.y, -h.z},
           {-h.x, h.y, -h.z},
           {-h.x, -h.y, h.z},
           {h.x, -h.y, h.z},
           {h.x, h.y, h.z},
           {-h.x, h.y, h.z}},
          {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
}

PolygonSoup polygons_of(const ObjectSpec& spec) {
  switch (spec.shape) {
    case ShapeKind::sphere:
      return icosphere(spec.radius, spec.subdivisions);
    case ShapeKind::cone:
      return cone(spec.radius, spec.height, spec.segments);
    case ShapeKind::cylinder:
      return cylinder(spec.radius, spec.height, spec.segments);
    case ShapeKind::cube:
      return cube(spec.edge);
    case ShapeKind::box:
      return box(spec.size);
    case ShapeKind::mesh: {
      PolygonSoup soup =
          spec.file_bytes ? read_mesh(spec.file, *spec.file_bytes) : read_mesh_file(spec.file);
      if (spec.scale != 1) {
        for (Vec3& vertex : soup.vertices) vertex *= spec.scale;
        soup.coordinate_error *= spec.scale;
      }
      check_reach(soup, spec.file);
      return soup;
    }
    case ShapeKind::none:
    case ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("a compound has no polygons of its own: ask for those of its parts");
}

}  // namespace palpate::stimuli
