#pragma once
// The work of `palpate render`: forces along a path over a scene.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/commands/render/trajectory_csv.h"

namespace palpate::runner {

/// \throws UsageError: neither point nor ray
const rendering::Renderer& renderer_named(const std::string& name);

/// \param path  that faults name. \throws stimuli::MeshError
rendering::Scene build_scene(const std::string& path, const protocols::SceneSpec& spec,
                             const rendering::Renderer& renderer);

<<<<<<< HEAD
/// A row of the path, its tick, and what the renderer remembers after it.
using TickVisitor = std::function<void(const TimedPose&, const rendering::Rendering&,
                                       const rendering::RenderState&)>;

/// A tick for each pose, in order. \param scene  built from `spec`
void render_along(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                  const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                  const TickVisitor& visit);

/// The virtual stylus of a scene that stretches the real one; else the same. m.
rendering::LineProbe virtual_stylus(const protocols::SceneSpec& spec,
                                    const rendering::LineProbe& real);
=======
/// A tick for each pose, in order. \param scene  built from `spec` \param visit  gets the moving
/// bodies after the tick, too
void render_along(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                  const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                  const std::function<void(const TimedPose&, const rendering::Rendering&,
                                           std::span<const rendering::BodyPose>)>& visit);
>>>>>>> 7557149 (Objects that move: exact mass properties, free motion, collisions solved as a complementarity problem, the probe pushes and is pushed back; scene keys body and gravity, render --bodies)

/// The same for who does not ask where the bodies are.
inline void render_along(
    const rendering::Scene& scene, const protocols::SceneSpec& spec,
    const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
    const std::function<void(const TimedPose&, const rendering::Rendering&)>& visit) {
  render_along(scene, spec, renderer, poses,
               [&visit](const TimedPose& pose, const rendering::Rendering& rendering,
                        std::span<const rendering::BodyPose>) { visit(pose, rendering); });
}

}  // namespace palpate::runner
