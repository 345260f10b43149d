#include "runner/display/scene_mesh.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "stimuli/compose.h"
#include "stimuli/parts/triangulate.h"
#include "stimuli/primitives.h"

namespace palpate::runner {
namespace {

constexpr int kSides = 24;

void add(const stimuli::PolygonSoup& soup, const Pose& pose, DrawnMesh& out) {
  std::vector<Vec3> corners;
  for (const auto& face : soup.faces) {
    corners.clear();
    for (const std::uint32_t corner : face)
      corners.push_back(pose.orientation * soup.vertices[corner] + pose.position);
    for (const auto& triangle : stimuli::triangulate(corners)) {
      const Vec3 across = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
      const double area = glm::length(across);
      if (!(area > 0)) continue;
      const glm::vec3 normal(across / area);
      for (const Vec3& corner : triangle) out.push_back({glm::vec3(corner), normal});
    }
  }
}

void add(const stimuli::ObjectSpec& spec, const Pose& parent, DrawnMesh& out) {
  const Pose pose = stimuli::compose(parent, spec.pose);
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) add(part, pose, out);
  } else {
    add(stimuli::polygons_of(spec), pose, out);
  }
}

glm::vec3 on_rim(int corner) {
  const double angle = 2 * M_PI * corner / kSides;
  return {std::cos(angle), std::sin(angle), 0};
}

}  // namespace

DrawnMesh triangles_of(const std::vector<stimuli::ObjectSpec>& objects) {
  DrawnMesh out;
  for (const stimuli::ObjectSpec& object : objects) add(object, Pose(), out);
  return out;
}

DrawnMesh unit_cylinder() {
  DrawnMesh out;
  out.reserve(std::size_t{6} * kSides);
  const glm::vec3 up(0, 0, 1);
  for (int i = 0; i < kSides; ++i) {
    const glm::vec3 a = on_rim(i), b = on_rim(i + 1);
    for (const DrawnVertex& corner :
         {DrawnVertex{a, a}, {b, b}, {b + up, b}, {a, a}, {b + up, b}, {a + up, a}}) {
      out.push_back(corner);
    }
  }
  return out;
}

DrawnMesh unit_cone() {
  DrawnMesh out;
  out.reserve(std::size_t{6} * kSides);
  const glm::vec3 apex(0, 0, 1), down(0, 0, -1);
  for (int i = 0; i < kSides; ++i) {
    const glm::vec3 a = on_rim(i), b = on_rim(i + 1);
    const glm::vec3 normal = glm::normalize(a + b + apex);
    for (const DrawnVertex& corner : {DrawnVertex{a, normal}, {b, normal}, {apex, normal}}) {
      out.push_back(corner);
    }
    for (const DrawnVertex& corner : {DrawnVertex{b, down}, {a, down}, {glm::vec3(0), down}}) {
      out.push_back(corner);
    }
  }
  return out;
}

DrawnMesh unit_sphere() {
  DrawnMesh out;
  add(stimuli::icosphere(1, 3), Pose(), out);
  for (DrawnVertex& corner : out) corner.normal = corner.position;  // smooth
  return out;
}

}  // namespace palpate::runner
