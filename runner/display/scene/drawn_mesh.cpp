#include "runner/display/scene/drawn_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>
#include <utility>

#include "stimuli/convex_mesh.h"
#include "stimuli/face_triangles.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"
#include "stimuli/texture.h"

namespace palpate::runner::display {
namespace {

constexpr int kSides = 24;
constexpr float kFlattest = 0.866F;  // least cosine between normals that are smoothed

void add(const stimuli::PolygonSoup& soup, const Pose& pose, DrawnMesh& out) {
  std::vector<Vec3> corners;
  for (const auto& face : soup.faces) {
    corners.clear();
    for (const std::uint32_t corner : face)
      corners.push_back(pose.orientation * soup.vertices[corner] + pose.position);
    for (const auto& [a, b, c] : stimuli::face_triangles(corners)) {
      const Vec3 across = glm::cross(corners[b] - corners[a], corners[c] - corners[a]);
      const double area = glm::length(across);
      if (!(area > 0)) continue;
      const glm::vec3 normal(across / area);
      for (const std::uint32_t k : {a, b, c}) out.push_back({glm::vec3(corners[k]), normal});
    }
  }
}

void add_object(const stimuli::ObjectSpec& spec, const Pose& pose, DrawnMesh& out) {
  if (spec.shape == stimuli::ShapeKind::none) return;
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts)
      add_object(part, stimuli::compose(pose, part.pose), out);
  } else {
    add(stimuli::polygons_of(spec), pose, out);
  }
}

glm::vec3 on_rim(int corner) {
  const double angle = 2 * M_PI * corner / kSides;
  return {std::cos(angle), std::sin(angle), 0};
}

}  // namespace

DrawnMesh surface_mesh(std::span<const Vec3> places,
                       std::span<const std::array<std::uint32_t, 3>> triangles,
                       std::span<const float> tints) {
  DrawnMesh out;
  out.reserve(3 * triangles.size());
  for (const auto& corners : triangles) {
    const Vec3 &a = places[corners[0]], &b = places[corners[1]], &c = places[corners[2]];
    const Vec3 across = glm::cross(b - a, c - a);
    const double area = glm::length(across);
    if (!(area > 0)) continue;
    const glm::vec3 normal(across / area);
    for (const std::uint32_t corner : corners) {
      out.push_back({glm::vec3(places[corner]), normal, tints.empty() ? 0.0F : tints[corner]});
    }
  }
  smooth(out);
  return out;
}

DrawnMesh with_texture(const DrawnMesh& mesh, const stimuli::Texture& texture) {
  constexpr double kMostTriangles = 5e5, kOfPeriod = 0.125;
  double area = 0;
  for (std::size_t i = 0; i + 2 < mesh.size(); i += 3) {
    const glm::vec3 &a = mesh[i].position, &b = mesh[i + 1].position, &c = mesh[i + 2].position;
    area += 0.5 * glm::length(glm::cross(b - a, c - a));
  }
  const double edge = std::max(kOfPeriod * texture.period(), std::sqrt(2 * area / kMostTriangles));
  DrawnMesh out;
  const auto corner = [&](const DrawnVertex& a, const DrawnVertex& b, const DrawnVertex& c, float u,
                          float v) {
    const float w = 1 - u - v;
    DrawnVertex at{w * a.position + u * b.position + v * c.position,
                   glm::normalize(w * a.normal + u * b.normal + v * c.normal),
                   w * a.tint + u * b.tint + v * c.tint};
    const Vec3 n(at.normal);
    const Vec3 aside = std::abs(n.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
    const Vec3 first = glm::normalize(glm::cross(n, aside)), second = glm::cross(n, first);
    const stimuli::PlaneHeight h = texture.mean_height(Vec3(at.position), Vec3(0), first, second);
    at.normal = glm::vec3(glm::normalize(n - h.slope[0] * first - h.slope[1] * second));
    return at;
  };
  for (std::size_t i = 0; i + 2 < mesh.size(); i += 3) {
    const DrawnVertex &a = mesh[i], &b = mesh[i + 1], &c = mesh[i + 2];
    const double longest =
        std::max({glm::distance(a.position, b.position), glm::distance(b.position, c.position),
                  glm::distance(c.position, a.position)});
    const int cuts = std::max(1, static_cast<int>(std::ceil(longest / edge)));
    const auto at = [&](int j, int k) {
      return corner(a, b, c, static_cast<float>(j) / static_cast<float>(cuts),
                    static_cast<float>(k) / static_cast<float>(cuts));
    };
    for (int j = 0; j < cuts; ++j) {
      for (int k = 0; j + k < cuts; ++k) {
        for (const auto& [u, v] : {std::pair(j, k), {j + 1, k}, {j, k + 1}})
          out.push_back(at(u, v));
        if (j + k + 1 >= cuts) continue;
        for (const auto& [u, v] : {std::pair(j + 1, k), {j + 1, k + 1}, {j, k + 1}})
          out.push_back(at(u, v));
      }
    }
  }
  return out;
}

DrawnMesh triangles_of(const stimuli::ObjectSpec& object) {
  DrawnMesh out;
  if (object.shape == stimuli::ShapeKind::mesh && stimuli::is_gmsh_file_name(object.file)) {
    const stimuli::SolidMesh solid = stimuli::solid_of_file(object);
    return surface_mesh(solid.nodes, stimuli::surface_of(solid), {});
  }
  add_object(object, Pose(), out);
  smooth(out);
  return out;
}

void add_facets(const stimuli::ConvexMesh& mesh, const Pose& pose, DrawnMesh& out) {
  add(mesh.polygons(), pose, out);
}

void smooth(DrawnMesh& mesh) {
  // Corners within a thousandth of the size count as one place.
  float size = 0;
  for (const DrawnVertex& corner : mesh)
    size = std::max(size, std::abs(corner.position.x) + std::abs(corner.position.y) +
                              std::abs(corner.position.z));
  if (!(size > 0)) return;
  const float cell = 1e-4F * size;
  using Place = std::array<std::int64_t, 3>;
  std::vector<std::pair<Place, std::size_t>> places(mesh.size());
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const glm::vec3& p = mesh[i].position;
    places[i] = {{std::llround(p.x / cell), std::llround(p.y / cell), std::llround(p.z / cell)}, i};
  }
  std::ranges::sort(places);
  // Weight each triangle by its angle at the corner: the triangulation of a face then does not
  // matter.
  std::vector<float> angles(mesh.size());
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const std::size_t first = i - i % 3;
    const glm::vec3& p = mesh[i].position;
    const glm::vec3 a = glm::normalize(mesh[first + (i + 1) % 3].position - p);
    const glm::vec3 b = glm::normalize(mesh[first + (i + 2) % 3].position - p);
    angles[i] = std::acos(std::clamp(glm::dot(a, b), -1.0F, 1.0F));
  }
  const DrawnMesh flat = mesh;
  for (std::size_t first = 0, last = 0; first < places.size(); first = last) {
    while (last < places.size() && places[last].first == places[first].first) ++last;
    const std::span<const std::pair<Place, std::size_t>> corners(&places[first], last - first);
    for (const auto& [place, i] : corners) {
      glm::vec3 sum(0);
      for (const auto& [same_place, k] : corners) {
        if (glm::dot(flat[i].normal, flat[k].normal) > kFlattest) sum += angles[k] * flat[k].normal;
      }
      if (glm::length(sum) > 0) mesh[i].normal = glm::normalize(sum);
    }
  }
}

// Moeller & Trumbore 1997, front faces only.
std::optional<float> distance_to(const DrawnMesh& mesh, const glm::vec3& from,
                                 const glm::vec3& along) {
  std::optional<float> nearest;
  for (std::size_t i = 0; i + 2 < mesh.size(); i += 3) {
    const glm::vec3 corner = mesh[i].position;
    const glm::vec3 a = mesh[i + 1].position - corner, b = mesh[i + 2].position - corner;
    const glm::vec3 p = glm::cross(along, b);
    const float size = glm::dot(a, p);
    if (!(size > 0)) continue;
    const glm::vec3 off = from - corner, q = glm::cross(off, a);
    const float u = glm::dot(off, p), v = glm::dot(along, q), t = glm::dot(b, q) / size;
    if (u < 0 || v < 0 || u + v > size || t <= 0) continue;
    if (!nearest || t < *nearest) nearest = t;
  }
  return nearest;
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
  for (DrawnVertex& corner : out) corner.normal = glm::normalize(corner.position);
  return out;
}

}  // namespace palpate::runner::display
