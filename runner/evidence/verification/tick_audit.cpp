#include "runner/evidence/verification/tick_audit.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

/// Relative to the contact's force; levers relative to the lengths from which they were computed.
double force_error(const rendering::Renderer& renderer, const rendering::LineProbe& probe,
                   const rendering::Rendering& r, double stiffness, double size) {
  const double full = stiffness * r.deepest.depth;
  if (full == 0) return glm::length(r.force) + glm::length(r.torque);
  const double lever = size + glm::length(probe.tip) + glm::length(probe.tail);
  const Vec3 moment =
      renderer.side_contact() ? glm::cross(r.deepest.point - probe.tip, r.force) : Vec3(0);
  const Vec3 by_devices = glm::cross(probe.tail - probe.tip, r.device2);
  return std::max({glm::length(r.force - full * r.deepest.normal) / full,
                   std::abs(glm::length(r.deepest.normal) - 1),
                   glm::length(r.device1 + r.device2 - r.force) / full,
                   glm::length(r.torque - moment) / (full * lever),
                   glm::length(r.torque - by_devices) / (full * lever)});
}

}  // namespace

rendering::LineProbe felt_probe(const rendering::Scene& scene, const rendering::Renderer& renderer,
                                const rendering::LineProbe& probe) {
  const rendering::ScenePart& part = scene.parts()[0];
  const Vec3 tip = part.local_point(probe.tip);
  return {tip, renderer.side_contact() ? part.local_point(probe.tail) : tip};
}

bool all_finite(const rendering::Rendering& r) {
  return finite(r.force) && finite(r.torque) && finite(r.device1) && finite(r.device2) &&
         finite(r.deepest.point) && finite(r.deepest.normal) && std::isfinite(r.deepest.depth) &&
         std::isfinite(r.deepest.along) && finite(r.ideal.tip) && finite(r.ideal.tail) &&
         finite(r.ideal_side);
}

TickAudit audit_tick(const rendering::Scene& scene, const rendering::Renderer& renderer,
                     const rendering::LineProbe& probe, const rendering::Rendering& r,
                     double rounding) {
  const rendering::ScenePart& part = scene.parts()[0];
  const stimuli::ConvexMesh& mesh = *part.mesh;
  TickAudit audit;
  audit.tolerance =
      rounding * mesh.size() + 1e-15 * (mesh.size() + glm::length(part.position) +
                                        glm::length(probe.tip) + glm::length(probe.tail));
  audit.finite = all_finite(r);
  if (!audit.finite) return audit;
  audit.depth = reference_depth(mesh, felt_probe(scene, renderer, probe)).depth;
  if (r.contacts == 0) {
    audit.missed = std::max(0.0, audit.depth);
    audit.force = glm::length(r.force) + glm::length(r.torque) + glm::length(r.device1) +
                  glm::length(r.device2);
    return audit;
  }
  const rendering::LineProbe ideal = felt_probe(scene, renderer, r.ideal);
  audit.penetrates = std::max(0.0, reference_depth(mesh, ideal).depth);
  audit.floats = reference_gap(mesh, ideal);
  audit.shallow = std::max(0.0, audit.depth - r.deepest.depth);
  audit.force = force_error(renderer, probe, r, part.material.stiffness, mesh.size());
  return audit;
}

}  // namespace palpate::runner::evidence
