#pragma once
// The work of `palpate render`: forces along a path over a scene.

#include <functional>
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

}  // namespace palpate::runner
