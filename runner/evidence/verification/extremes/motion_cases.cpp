#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runner/evidence/verification/extremes/audited_scene.h"
#include "runner/evidence/verification/extremes/cases.h"
#include "runner/evidence/verification/random_draws.h"
#include "runner/evidence/verification/random_paths.h"
#include "runner/evidence/verification/random_solids.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence::extremes {
namespace {

/// 0, values small enough that rounding may hide them, and slightly larger ones.
constexpr double kTiny[] = {0, 1e-17, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3};

}  // namespace

ExtremeResult thin_plate(const rendering::Renderer& renderer) {
  constexpr double kThickness = 1e-4, kEdge = 0.1, kStep = 0.005;  // m; 5 m/s at 1 kHz
  const MeshPointer plate = solid(stretched(stimuli::cube(kEdge), {1, 1, kThickness / kEdge}));
  CombinedResult all;
  for (std::uint64_t round = 0; round < 2000; ++round) {
    Random random(round, {1});
    AuditedScene scene(renderer, plate);
    const double side = round % 2 ? 1 : -1;
    Vec3 direction = random_direction(random);
    direction.z = side * (std::abs(direction.z) + 0.02);
    const Vec3 start(between(random, -0.02, 0.02), between(random, -0.02, 0.02),
                     side * (kThickness / 2 + between(random, 0.006, 0.011)));
    const rendering::LineProbe probe{start, start + kStylus * glm::normalize(direction)};
    double went_wrong = 0;
    for (int i = 0; i < 8; ++i) {
      const rendering::Rendering r =
          scene.audited_tick(translated(probe, Vec3(0, 0, -side * kStep * i)));
      const double depth = side * (side * kThickness / 2 - (start.z - side * kStep * i));
      const bool held = r.contacts == 1 && r.deepest.normal.z * side > 0.999999 &&
                        std::abs(r.deepest.depth - depth) < 1e-12;
      went_wrong += depth > 0 ? !held : r.contacts != 0;
    }
    ExtremeResult result = scene.result();
    result.worst = went_wrong;
    result.limit = 0;
    if (went_wrong > 0 && result.detail.empty()) {
      result.detail = "round " + std::to_string(round) + ": not held on the side of entry";
    }
    result.passed = result.detail.empty();
    all.add(result);
  }
  return all.result();
}

ExtremeResult parallel_edge(const rendering::Renderer& renderer) {
  const MeshPointer box = solid(stimuli::cube(0.06));
  CombinedResult all;
  Random random(2);
  for (const double tilt : kTiny) {
    for (const double beside : kTiny) {
      for (int round = 0; round < 12; ++round) {
        AuditedScene scene(renderer, box);
        // Approaches the edge at y = z = 0.03 from above or from the corner, then moves around the
        // edge, along it and off its end.
        Vec3 u = Vec3(round % 2 ? 1 : -1, 0, 0) + tilt * random_direction(random);
        u = glm::normalize(u);
        const double back = (round % 3) * 0.06;
        Vec3 at(0.005, 0.03 + beside - 2 * beside * (round % 4 == 0), 0.05);
        scene.audited_tick({at - back * u, at + (kStylus - back) * u});
        const Vec3 motions[] = {{0, 0, -0.001}, {0, 0.001, 0}, {0, -0.001, 0},
                                {0.003, 0, 0},  {0, 0, 0.001}, {0, 0.0005, -0.0005}};
        for (int leg = 0; leg < 60; ++leg) {
          const Vec3 motion = leg < 21 ? motions[0] : motions[random.below(6)];
          at += motion;
          scene.audited_tick({at - back * u, at + (kStylus - back) * u});
        }
        all.add(scene.result());
      }
    }
  }
  return all.result();
}

ExtremeResult through_vertices(const rendering::Renderer& renderer) {
  const MeshPointer shapes[] = {solid(stimuli::cube(0.06)), solid(stimuli::icosphere(0.03, 1)),
                                solid(stimuli::cone(0.03, 0.06, 16))};
  CombinedResult all;
  Random random(4);
  for (const MeshPointer& mesh : shapes) {
    for (const Vec3& vertex : mesh->vertices()) {
      for (const double beside : {0.0, 1e-16, 1e-12, 1e-9}) {
        AuditedScene scene(renderer, mesh);
        const Vec3 out = glm::normalize(vertex), u = random_direction(random);
        const double back = renderer.side_contact() ? kStylus * random.unit() : 0;
        const Vec3 aside = beside * random_direction(random);
        for (const double height : {0.3, 0.001, 1e-9, 0.0, -1e-9, -0.0005, -0.001, -0.0015}) {
          const Vec3 at = vertex + height * out + aside;
          scene.audited_tick({at - back * u, at + (kStylus - back) * u});
        }
        ExtremeResult result = scene.result();
        all.add(result);
      }
    }
  }
  return all.result();
}

ExtremeResult zero_length(const rendering::Renderer& renderer) {
  // A probe without length is a point: the force of the point renderer, and no force on device 2.
  const MeshPointer mesh = solid(stimuli::icosphere(0.03, 2));
  AuditedScene scene(renderer, mesh), point(rendering::point_renderer(), mesh);
  Random random(6);
  double worst = 0;
  for (const rendering::LineProbe& probe :
       random_path(random, PathKind::smooth, *mesh, 0, false, 3000)) {
    const rendering::Rendering r = scene.audited_tick(probe), p = point.audited_tick(probe);
    worst = std::max({worst, glm::length(r.force - p.force), glm::length(r.torque),
                      glm::length(r.device2), glm::length(r.device1 - p.force)});
  }
  ExtremeResult result = scene.result();
  result.worst = worst;
  result.limit = 1e-12;
  result.passed = result.passed && worst <= result.limit;
  if (worst > result.limit && result.detail.empty()) result.detail = "not a point's force";
  return result;
}

ExtremeResult tiny_length(const rendering::Renderer& renderer) {
  // Lengths below the rounding of coordinates exist only near the mesh's origin, so use meshes
  // whose surface passes through it.
  const stimuli::PolygonSoup shapes[] = {stimuli::icosphere(0.03, 1), stimuli::cube(0.06)};
  CombinedResult all;
  for (const stimuli::PolygonSoup& shape : shapes) {
    for (int i = 0; i < 8; ++i) {
      Random random(static_cast<std::uint64_t>(i), {8});
      // The origin is at a corner, or somewhere inside.
      const Vec3 corner = shape.vertices[random.below(shape.vertices.size())];
      const Vec3 to = i < 2 ? -corner : -between(random, 0, 0.9) * corner;
      const MeshPointer mesh = solid(turned_and_moved(shape, Quat(1, 0, 0, 0), 1, to));
      for (const double length : {1e-6, 1e-12, 1e-20, 1e-100, 1e-150, 1e-153, 1e-155, 1e-158,
                                  1e-160, 1e-162, 1e-200, 1e-308, 5e-324}) {
        AuditedScene scene(renderer, mesh);
        const Vec3 u = i % 3 == 0 ? Vec3(1, 0, 0) : random_direction(random);
        const Vec3 out = glm::normalize(corner);
        scene.audited_tick({0.1 * out, 0.1 * out + length * u});
        for (int round = 0; round < 10; ++round) {
          scene.audited_tick({Vec3(0), length * u});
          // From under another facet back to the origin.
          const Vec3 at = 0.02 * random.unit() * random_direction(random);
          scene.audited_tick({at, at + length * u});
        }
        all.add(scene.result());
      }
    }
  }
  return all.result();
}

ExtremeResult starts_inside(const rendering::Renderer& renderer) {
  const MeshPointer mesh = solid(stimuli::cone(0.03, 0.06, 32));
  CombinedResult all;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed, {9});
    AuditedScene scene(renderer, mesh);
    const Vec3 inside = Vec3(0, 0, -0.01) + 0.005 * random.unit() * random_direction(random);
    const Vec3 u = random_direction(random);
    const auto probe = [&](double out) {
      return rendering::LineProbe{inside + out * u, inside + (out + kStylus) * u};
    };
    double forces = 0;
    bool bits = true;
    for (int i = 0; i < 5; ++i) {
      const rendering::Rendering r = scene.tick(probe(0.0005 * i));
      forces += glm::length(r.force) + glm::length(r.torque);
      bits = bits && r.faults == rendering::render_fault::kStartedInside && r.contacts == 0;
    }
    // Left once, and back in: contact.
    bits = bits && scene.audited_tick(probe(0.1)).contacts == 0;
    bits = bits && scene.audited_tick(probe(0.0)).contacts == 1;
    if (!bits)
      scene.fail("seed " + std::to_string(seed) +
                 ": wrong fault bits, or no contact after leaving");
    ExtremeResult result = scene.result();
    result.worst = forces;
    result.limit = 0;
    result.passed = result.passed && forces == 0;
    all.add(result);
  }
  return all.result();
}

ExtremeResult teleports(const rendering::Renderer& renderer) {
  CombinedResult all;
  const MeshPointer shapes[] = {solid(stimuli::cube(0.06)), solid(stimuli::icosphere(0.03, 2)),
                                solid(stimuli::cylinder(0.03, 0.06, 64)),
                                solid(stretched(stimuli::cube(0.1), {1, 1, 1e-3}))};
  for (const MeshPointer& mesh : shapes) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      Random random(seed, {10});
      AuditedScene scene(renderer, mesh);
      scene.audited_tick({Vec3(0, 0, 1), Vec3(0, 0, 1 + kStylus)});
      for (int i = 0; i < 200; ++i) {
        // Near, far, very far; about half of them along the axes.
        const double reach = i % 5 == 0 ? 1e5 : i % 5 == 1 ? 1 : 0.05;
        const Vec3 tip = reach * random.unit() * random_direction(random);
        const Vec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        const Vec3 u = random.below(2) ? axes[random.below(3)] : random_direction(random);
        scene.audited_tick({tip, tip + kStylus * u});
      }
      all.add(scene.result());
    }
  }
  return all.result();
}

ExtremeResult bad_poses(const rendering::Renderer& renderer) {
  // Before contact, in contact and behind a plate: no force and the fault bit; the next valid pose
  // is rendered as if nothing had happened.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const MeshPointer mesh = solid(stretched(stimuli::cube(0.1), {1, 1, 1e-3}));
  AuditedScene scene(renderer, mesh);
  double worst = 0;
  for (const double height : {0.01, -0.0001, -0.01}) {
    for (const double value : {kNaN, kInfinity, -kInfinity, 1e300, -1e20, 1.1e6}) {
      for (int k = 0; k < 6; ++k) {
        scene.audited_tick({Vec3(0.01, 0, 0.02), Vec3(0.01, 0.01, 0.14)});
        const rendering::LineProbe good{Vec3(0.01, 0, height), Vec3(0.01, 0.01, height + kStylus)};
        const rendering::Rendering before = scene.audited_tick(good);
        rendering::LineProbe bad = good;
        (k < 3 ? bad.tip : bad.tail)[k % 3] = value;
        const rendering::Rendering broken = scene.tick(bad);
        worst = std::max({worst, glm::length(broken.force), glm::length(broken.torque),
                          glm::length(broken.device1), glm::length(broken.device2)});
        if (!(broken.faults & rendering::render_fault::kNonFinite)) scene.fail("no fault bit");
        const rendering::Rendering after = scene.audited_tick(good);
        worst = std::max(worst, glm::length(after.force - before.force));
      }
    }
  }
  ExtremeResult result = scene.result();
  result.worst = worst;
  result.limit = 0;
  result.passed = result.passed && worst == 0;
  if (worst > 0 && result.detail.empty()) result.detail = "a force at a bad pose or after it";
  return result;
}

}  // namespace palpate::runner::evidence::extremes
