#include "runner/commands/render/forces.h"

#include <glm/geometric.hpp>

#include "protocols/protocol.h"
#include "runner/commands/shared/command.h"
#include "runner/scene_builder.h"

namespace palpate::runner {
namespace {

rendering::Reach reach_for(const protocols::ReachSpec& spec, const rendering::LineProbe& real) {
  constexpr double kGrip = protocols::Protocol::Stylus{}.grip;  // as where a protocol does not say
  return reach_of(spec, glm::distance(real.tip, real.tail), kGrip);
}

/// One tick of a stylus that reaches farther than it is long.
rendering::Rendering extended_tick(const rendering::Scene& scene, rendering::RenderState& state,
                                   const rendering::Renderer& renderer,
                                   const protocols::ReachSpec& spec,
                                   const rendering::LineProbe& real, double dt) {
  const rendering::Reach reach = reach_for(spec, real);
  return felt(reach, renderer.tick(scene, state, stretched(reach, real), dt));
}

}  // namespace

const rendering::Renderer& renderer_named(const std::string& name) {
  if (name != "point" && name != "ray")
    throw UsageError("--renderer: must be point or ray, not '" + name + "'");
  return renderer_for(name == "ray" ? protocols::RendererKind::ray
                                    : protocols::RendererKind::point);
}

rendering::Scene build_scene(const std::string& path, const protocols::SceneSpec& spec,
                             const rendering::Renderer& renderer) {
  try {
    return SceneBuilder().build(spec.objects, renderer.side_contact(), tool_of(spec.tool),
                                spec.gravity,
                                spec.tool.radius > 0 ? spec.tool.radius : protocols::kSoftRadius);
  } catch (const stimuli::MeshError& error) {
    std::vector<std::string> faults;
    for (const std::string& fault : error.faults()) {
      faults.push_back(std::string(path).append(": ").append(fault));
    }
    throw stimuli::MeshError(std::move(faults));
  }
}

void render_along(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                  const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                  const TickVisitor& visit) {
  rendering::RenderState state = scene.initial_state();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double dt = i > 0 ? poses[i].t - poses[i - 1].t : 0;
    state.measured_side = poses[i].side;
    const rendering::Rendering rendering =
        spec.reach ? extended_tick(scene, state, renderer, *spec.reach, poses[i].probe, dt)
                   : renderer.tick(scene, state, poses[i].probe, dt);
    visit(poses[i], rendering, state);
  }
}

rendering::LineProbe virtual_stylus(const protocols::SceneSpec& spec,
                                    const rendering::LineProbe& real) {
  return spec.reach ? stretched(reach_for(*spec.reach, real), real) : real;
}

}  // namespace palpate::runner
