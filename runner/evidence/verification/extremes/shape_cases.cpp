#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include "runner/evidence/verification/extremes/audited_scene.h"
#include "runner/evidence/verification/extremes/cases.h"
#include "runner/evidence/verification/random_paths.h"
#include "runner/evidence/verification/random_solids.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence::extremes {
namespace {

constexpr std::size_t kTicks = 300;  // a path

Pose some_pose(const Vec3& position) {
  Random random(3);
  return {position, stimuli::uniform_rotation(random)};
}

/// Every face with corners of its own, each followed by faces without area.
stimuli::PolygonSoup with_duplicates(const stimuli::PolygonSoup& soup) {
  stimuli::PolygonSoup out;
  for (const auto& face : soup.faces) {
    std::vector<std::uint32_t> own;
    for (const std::uint32_t v : face) {
      own.push_back(static_cast<std::uint32_t>(out.vertices.size()));
      out.vertices.push_back(soup.vertices[v]);
      out.vertices.push_back(soup.vertices[v]);
    }
    out.faces.push_back(own);
    out.faces.push_back({own[0], own[0] + 1, own[1]});
    out.faces.push_back({own[0] + 1, own[0], own[1]});
  }
  return out;
}

/// A disc whose upper side is a cone that rises by `angle` (rad) only.
stimuli::PolygonSoup nearly_flat_cone(double angle, int segments) {
  stimuli::PolygonSoup soup = stimuli::cylinder(0.05, 0.02, segments);
  const double top = 0.01;
  stimuli::PolygonSoup out;
  out.vertices = soup.vertices;
  const auto apex = static_cast<std::uint32_t>(out.vertices.size());
  out.vertices.emplace_back(0, 0, top + 0.05 * std::tan(angle));
  for (const auto& face : soup.faces) {
    bool is_top = true;
    for (const std::uint32_t v : face) is_top = is_top && soup.vertices[v].z > 0;
    if (!is_top) {
      out.faces.push_back(face);
      continue;
    }
    for (std::size_t k = 0; k < face.size(); ++k) {
      out.faces.push_back({face[k], face[(k + 1) % face.size()], apex});
    }
  }
  return out;
}

/// Paths of all kinds over one object, with probes of these lengths (m).
ExtremeResult paths_over(const rendering::Renderer& renderer, const MeshPointer& mesh,
                         const Pose& pose, const std::vector<double>& lengths, std::size_t ticks) {
  CombinedResult all;
  std::uint64_t stream = 0;
  for (const double length : lengths) {
    for (int kind = 0; kind < kPathKinds; ++kind) {
      Random random(17, {++stream});
      AuditedScene scene(renderer, mesh, pose);
      for (const rendering::LineProbe& probe :
           random_path(random, static_cast<PathKind>(kind), *mesh, length, renderer.side_contact(),
                       ticks)) {
        scene.audited_tick(probe);
      }
      all.add(scene.result());  // one path may miss a needle; all together may not
    }
  }
  return all.result();
}

}  // namespace

ExtremeResult sliver(const rendering::Renderer& renderer) {
  // A blade, and a tetrahedron whose every face is a sliver of 1 to 1,000,000.
  const MeshPointer blade = solid(stretched(stimuli::cube(0.1), {1, 1e-6, 1}));
  stimuli::PolygonSoup wedge;
  wedge.vertices = {{-0.05, 0, 0}, {0.05, 0, 0}, {0, -5e-8, 1e-7}, {0, 5e-8, 1e-7}};
  wedge.faces = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  CombinedResult all;
  all.add(paths_over(renderer, blade, {}, {0.1, kStylus, 1e-6}, kTicks));
  all.add(paths_over(renderer, solid(wedge), some_pose({0.1, 0, 0}), {0.1, kStylus}, kTicks));
  return all.result();
}

ExtremeResult needle(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stretched(stimuli::cylinder(0.05, 0.1, 12), {1e-5, 1e-5, 1})),
                    some_pose({0, 0.2, 0}), {0, 0.01, kStylus}, kTicks);
}

ExtremeResult nearly_coplanar(const rendering::Renderer& renderer) {
  CombinedResult all;
  for (const double angle : {1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13}) {
    all.add(paths_over(renderer, solid(nearly_flat_cone(angle, 24)), {}, {kStylus}, kTicks));
  }
  return all.result();
}

ExtremeResult duplicate_vertices(const rendering::Renderer& renderer) {
  const stimuli::PolygonSoup shapes[] = {stimuli::cube(0.06), stimuli::icosphere(0.03, 2),
                                         stimuli::cone(0.03, 0.06, 32)};
  CombinedResult all;
  for (const stimuli::PolygonSoup& soup : shapes) {
    all.add(paths_over(renderer, solid(with_duplicates(soup)), {}, {kStylus}, kTicks));
  }
  return all.result();
}

ExtremeResult small_object(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stimuli::icosphere(5e-5, 2)), some_pose({0.05, 0, 0.02}),
                    {0, 1e-4, kStylus}, kTicks);
}

ExtremeResult large_object(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stimuli::icosphere(50, 3)), {}, {0, kStylus, 300}, kTicks);
}

ExtremeResult far_object(const rendering::Renderer& renderer) {
  return paths_over(renderer, solid(stimuli::cone(0.03, 0.06, 64)), some_pose({1000, 0, 0}),
                    {0, kStylus}, kTicks);
}

ExtremeResult million_triangles(const rendering::Renderer& renderer) {
  // 1,310,720 triangles with edges of 0.1 mm on average.
  const MeshPointer mesh = solid(stimuli::icosphere(0.0216, 8));
  AuditedScene scene(renderer, mesh);
  Random random(5);
  // The reference scans every triangle, so take few ticks, from free space to sliding at 0.1 m/s.
  const Vec3 axis = stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
  const Vec3 across = glm::normalize(glm::cross(axis, Vec3(1, 0, 0)));
  for (int i = 0; i < 60; ++i) {
    const double turn = 1e-4 * i / 0.0216, depth = i < 2 ? -0.005 : 0.001 * std::sin(0.2 * i);
    const Vec3 out = std::cos(turn) * axis + std::sin(turn) * across;
    const Vec3 direction = glm::normalize(out + (0.5 + 0.05 * i) * across);
    const Vec3 tip = (0.0216 - depth) * out;
    scene.audited_tick({tip, tip + kStylus * direction});
  }
  return scene.result();
}

}  // namespace palpate::runner::evidence::extremes
