#pragma once
// Objects made of several convex parts, and what must hold of an ideal tool beside them, by
// definition.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "rendering/scene.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::testing {

using MeshPointer = std::shared_ptr<const stimuli::ConvexMesh>;

inline MeshPointer mesh_of(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

inline stimuli::PolygonSoup box_soup(const Vec3& low, const Vec3& high) {
  stimuli::PolygonSoup soup = stimuli::cube(1);
  for (Vec3& v : soup.vertices) v = 0.5 * (low + high) + v * (high - low);
  return soup;
}

inline MeshPointer box(const Vec3& low, const Vec3& high) { return mesh_of(box_soup(low, high)); }

/// The half of a convex solid with dot(normal, p) <= offset; its cut face closes it.
inline stimuli::PolygonSoup cut_off(const stimuli::PolygonSoup& soup, const Vec3& normal,
                                    double offset) {
  stimuli::PolygonSoup out;
  std::vector<Vec3> rim;
  const auto height = [&](const Vec3& p) { return glm::dot(normal, p) - offset; };
  const auto add = [&](const Vec3& p) {
    out.vertices.push_back(p);
    return static_cast<std::uint32_t>(out.vertices.size() - 1);
  };
  for (const auto& face : soup.faces) {
    std::vector<std::uint32_t> kept;
    for (std::size_t k = 0; k < face.size(); ++k) {
      // The same two ends in the same order give the same point in both faces of an edge.
      const std::uint32_t i = face[k], j = face[(k + 1) % face.size()];
      const Vec3 &from = soup.vertices[std::min(i, j)], &to = soup.vertices[std::max(i, j)];
      if (height(soup.vertices[i]) <= 0) kept.push_back(add(soup.vertices[i]));
      if ((height(from) <= 0) == (height(to) <= 0)) continue;
      const Vec3 crossing = from + height(from) / (height(from) - height(to)) * (to - from);
      kept.push_back(add(crossing));
      rim.push_back(crossing);
    }
    if (kept.size() >= 3) out.faces.push_back(kept);
  }
  if (rim.empty()) return out;
  Vec3 middle(0);
  for (const Vec3& p : rim) middle += p / static_cast<double>(rim.size());
  const Vec3 x = glm::normalize(rim[0] - middle), y = glm::cross(normal, x);
  std::sort(rim.begin(), rim.end(), [&](const Vec3& a, const Vec3& b) {
    return std::atan2(glm::dot(a - middle, y), glm::dot(a - middle, x)) <
           std::atan2(glm::dot(b - middle, y), glm::dot(b - middle, x));
  });
  std::vector<std::uint32_t> cap;
  for (std::size_t k = 0; k < rim.size(); k += 2) cap.push_back(add(rim[k]));  // each comes twice
  out.faces.push_back(cap);
  return out;
}

/// Both halves of a solid that is cut through `point`.
inline std::vector<stimuli::PolygonSoup> cut_in_two(const stimuli::PolygonSoup& soup,
                                                    const Vec3& normal, const Vec3& point) {
  return {cut_off(soup, normal, glm::dot(normal, point)),
          cut_off(soup, -normal, -glm::dot(normal, point))};
}

/// One object of these parts.
inline std::vector<rendering::SceneObject> object_of(const std::vector<stimuli::PolygonSoup>& parts,
                                                     const Pose& pose = {}, double stiffness = 800,
                                                     int object = 0) {
  std::vector<rendering::SceneObject> out;
  for (const auto& part : parts)
    out.push_back(placed_object(mesh_of(part), pose, stiffness, object));
  return out;
}

/// A groove along y with its apex line in the origin: two blocks whose walls meet there at the
/// opening angle, rad, and overlap below.
inline std::vector<stimuli::PolygonSoup> groove(double opening) {
  constexpr double kHigh = 0.06, kBelow = 0.02, kThick = 0.03, kHalfLength = 0.1;  // m
  std::vector<stimuli::PolygonSoup> out;
  for (const double side : {-1.0, 1.0}) {
    const Vec3 up(side * std::sin(opening / 2), 0, std::cos(opening / 2));
    const Vec3 in(side * std::cos(opening / 2), 0, -std::sin(opening / 2));
    stimuli::PolygonSoup block = stimuli::cube(1);
    for (Vec3& v : block.vertices) {
      v = (v.z > 0 ? kHigh : -kBelow) * up + (v.x > 0 ? kThick : 0.0) * in +
          Vec3(0, (v.y > 0 ? kHalfLength : -kHalfLength), 0);
    }
    if (side < 0) {  // mirrored: the loops turn the other way
      for (auto& face : block.faces) std::reverse(face.begin(), face.end());
    }
    out.push_back(block);
  }
  return out;
}

/// m; how deep below all planes of the part the deepest point of the segment a..b is: > 0 where the
/// segment is inside. By definition, with nothing of the renderer but the mesh's planes.
inline double segment_depth(const rendering::ScenePart& part, const Vec3& a, const Vec3& b) {
  const Vec3 from = part.local_point(a), along = part.local_point(b) - from;
  // The least of the facets' depths is concave along the segment: halve where it still rises.
  double low = 0, high = 1, best = -HUGE_VAL;
  for (int i = 0; i < 50; ++i) {
    const double at = 0.5 * (low + high);
    double depth = HUGE_VAL, slope = 0;
    for (const stimuli::Facet& facet : part.mesh->facets()) {
      const double here = facet.offset - glm::dot(facet.normal, from + at * along);
      if (here >= depth) continue;
      depth = here;
      slope = -glm::dot(facet.normal, along);
    }
    best = std::max(best, depth);
    if (slope == 0) break;
    (slope > 0 ? low : high) = at;
  }
  return best;
}

}  // namespace palpate::testing
