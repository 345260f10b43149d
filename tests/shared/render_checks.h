#pragma once
// Properties of every tick of a renderer over one convex object, checked against the reference.

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>

#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "runner/evidence/verification/reference.h"
#include "tests/shared/probe_paths.h"

namespace palpate::testing {

inline constexpr double kTick = 1e-3;                          // s
inline constexpr double kBlendAngle = std::numbers::pi / 180;  // rad, epsilon of eq. (2)

inline rendering::SceneObject placed_object(std::shared_ptr<const stimuli::ConvexMesh> mesh,
                                            const Pose& pose = {}, double stiffness = 800,
                                            int object = 0) {
  rendering::SceneObject part;
  part.mesh = std::move(mesh);
  part.pose = pose;
  part.material.stiffness = stiffness;
  part.object = object;
  return part;
}

/// A renderer, a scene of one object and the memory between ticks.
class Bench {
 public:
  Bench(const rendering::Renderer& renderer, std::shared_ptr<const stimuli::ConvexMesh> mesh,
        const Pose& pose = {}, double stiffness = 800)
      : renderer_(renderer),
        mesh_(std::move(mesh)),
        pose_(pose),
        stiffness_(stiffness),
        scene_({placed_object(mesh_, pose, stiffness)}),
        state_(scene_.initial_state()) {}

  rendering::Rendering tick(const rendering::LineProbe& world) {
    return renderer_.tick(scene_, state_, world, kTick);
  }

  /// The part of the probe that the renderer feels, in the mesh frame: the tip alone, or all of it.
  rendering::LineProbe felt(const rendering::LineProbe& world) const {
    const rendering::LineProbe local = to_local(pose_, world);
    return renderer_.side_contact() ? local : rendering::LineProbe{local.tip, local.tip};
  }

  const stimuli::ConvexMesh& mesh() const { return *mesh_; }
  const Pose& pose() const { return pose_; }
  const rendering::Renderer& renderer() const { return renderer_; }
  double stiffness() const { return stiffness_; }
  rendering::RenderState& state() { return state_; }

  /// Rounding of lengths here, m: of the object, its place and the probe.
  double rounding(const rendering::LineProbe& world) const {
    return 1e-15 * (mesh_->size() + glm::length(pose_.position) + glm::length(world.tip) +
                    glm::length(world.tail));
  }

 private:
  const rendering::Renderer& renderer_;
  std::shared_ptr<const stimuli::ConvexMesh> mesh_;
  Pose pose_;
  double stiffness_;
  rendering::Scene scene_;
  rendering::RenderState state_;
};

/// Distance of a point from the surface of the solid, m.
inline double off_surface(const stimuli::ConvexMesh& mesh, const Vec3& point) {
  return std::max(
      runner::evidence::reference_gap(mesh, {point, point}),
      std::abs(std::max(0.0, runner::evidence::reference_depth(mesh, {point, point}).depth)));
}

/// Whether eq. (2) can place a contact at this point: over a facet that is parallel to the probe
/// within the blend's angle.
inline bool over_parallel_facet(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe,
                                const Vec3& point, double tolerance) {
  const Vec3 u = glm::normalize(probe.tail - probe.tip);
  for (const stimuli::Facet& facet : mesh.facets()) {
    if (std::abs(std::asin(glm::dot(facet.normal, u))) > kBlendAngle + 1e-9) continue;
    const double reach = glm::length(probe.tail - probe.tip) * std::sin(kBlendAngle);
    if (std::abs(glm::dot(facet.normal, point) - facet.offset) > reach + tolerance) continue;
    bool over = true;
    for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
      const stimuli::Side& side = mesh.sides()[i];
      over = over && glm::dot(side.inward, point) >= side.offset - tolerance;
    }
    if (over) return true;
  }
  return false;
}

/// Everything that is wrong with one tick; empty when nothing is. A tick that is free passes only
/// when the probe does not penetrate (`may_be_blocked`: it may, as it has been inside since the
/// start).
inline std::string faults_of_tick(const Bench& bench, const rendering::LineProbe& probe,
                                  const rendering::Rendering& r, bool may_be_blocked = false) {
  std::ostringstream out;
  out.precision(6);
  const stimuli::ConvexMesh& mesh = bench.mesh();
  const double size = mesh.size();
  const double rounding = bench.rounding(probe);
  const double reference = runner::evidence::reference_depth(mesh, bench.felt(probe)).depth;
  const auto demand_small = [&](const char* what, double value, double limit) {
    if (!(value <= limit)) out << what << ": " << value << " > " << limit << "; ";
  };

  for (const Vec3& v : {r.force, r.torque, r.device1, r.device2, r.deepest.point, r.deepest.normal,
                        r.ideal.tip, r.ideal.tail}) {
    if (!finite(v)) return "not finite";
  }
  if (r.contacts == 0) {
    if (r.force != Vec3() || r.torque != Vec3() || r.device1 != Vec3() || r.device2 != Vec3()) {
      out << "force without contact; ";
    }
    if (r.ideal.tip != probe.tip || r.ideal.tail != probe.tail) out << "ideal probe moved; ";
    if (r.deepest.type != rendering::ContactType::none || r.deepest.depth != 0 || r.object != -1) {
      out << "contact described without contact; ";
    }
    if (!may_be_blocked) demand_small("missed: depth", reference, 1e-9 * size + rounding);
    return out.str();
  }

  const rendering::Contact& contact = r.deepest;
  const double length = glm::length(probe.tail - probe.tip);
  if (r.contacts != 1 || r.object != 0 || r.faults != 0) {
    out << "contacts " << r.contacts << " object " << r.object << " faults " << r.faults << "; ";
  }
  if (contact.type == rendering::ContactType::none) out << "contact without type; ";
  if (!(contact.depth >= 0)) out << "negative depth; ";
  demand_small("normal's length", std::abs(glm::length(contact.normal) - 1), 1e-12);
  const Vec3 shift = contact.depth * contact.normal;
  demand_small("ideal tip", glm::length(r.ideal.tip - probe.tip - shift), 1e-12 * size + rounding);
  demand_small("ideal tail", glm::length(r.ideal.tail - probe.tail - shift),
               1e-12 * size + rounding);
  demand_small("ideal floats", runner::evidence::reference_gap(mesh, bench.felt(r.ideal)),
               1e-9 * size + rounding);
  demand_small("ideal penetrates",
               runner::evidence::reference_depth(mesh, bench.felt(r.ideal)).depth,
               1e-9 * size + rounding);
  demand_small("shallower than the reference by", reference - contact.depth,
               1e-12 * size + rounding);

  const double full = bench.stiffness() * contact.depth;
  demand_small("force is not k depth n", glm::length(r.force - full * contact.normal),
               1e-12 * full);
  demand_small("force off the normal", glm::length(glm::cross(r.force, contact.normal)),
               1e-14 * full);

  const rendering::LineProbe ideal = r.ideal;
  const double at_tolerance = 1e-12 * (size + length) + rounding;
  if (!bench.renderer().side_contact()) {
    if (r.torque != Vec3()) out << "torque of a point; ";
    if (contact.type != rendering::ContactType::point_polygon) out << "type of a point; ";
    demand_small("contact off the tip", glm::length(contact.point - ideal.tip), at_tolerance);
  } else {
    demand_small("torque", glm::length(r.torque - glm::cross(contact.point - probe.tip, r.force)),
                 full * at_tolerance);
    demand_small("moment of the devices",
                 glm::length(glm::cross(probe.tail - probe.tip, r.device2) - r.torque),
                 full * at_tolerance);
  }
  demand_small("sum of the devices", glm::length(r.device1 + r.device2 - r.force), 1e-12 * full);
  if (!(contact.along >= 0 && contact.along <= length * (1 + 1e-15))) {
    out << "contact at " << contact.along << " of " << length << "; ";
  }
  const Vec3 u = length > 0 ? (ideal.tail - ideal.tip) / length : Vec3();
  demand_small("contact off the ideal probe",
               glm::length(contact.point - ideal.tip - contact.along * u), at_tolerance);
  const Vec3 local = bench.felt({contact.point, contact.point}).tip;
  if (contact.type == rendering::ContactType::segment_face) {
    if (!over_parallel_facet(mesh, to_local(bench.pose(), ideal), local, 1e-9 * size + rounding)) {
      out << "contact off the touching portion; ";
    }
  } else {
    demand_small("contact off the surface", off_surface(mesh, local), 1e-9 * size + rounding);
  }
  return out.str();
}

/// Follows a path and checks every tick. Returns the first faulty tick with what is wrong; empty
/// when all is well. The path is in the mesh's frame.
class PathCheck {
 public:
  std::string follow(Bench& bench, const ProbePath& local_path) {
    bool started_inside = true;
    for (std::size_t i = 0; i < local_path.size(); ++i) {
      const rendering::LineProbe probe = to_world(bench.pose(), local_path[i]);
      const rendering::Rendering r = bench.tick(probe);
      // Only a probe that was inside from the first tick on may stay without force.
      started_inside =
          started_inside &&
          runner::evidence::reference_depth(bench.mesh(), bench.felt(probe)).depth >= 0;
      const std::string faults = faults_of_tick(bench, probe, r, started_inside);
      if (!faults.empty()) return "tick " + std::to_string(i) + ": " + faults;
      ++ticks;
      (r.contacts ? in_contact : free) += 1;
      if (r.contacts) ++of_type[static_cast<std::size_t>(r.deepest.type)];
    }
    return {};
  }

  int ticks = 0, in_contact = 0, free = 0;
  std::array<int, 4> of_type{};
};

}  // namespace palpate::testing
