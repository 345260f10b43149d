#pragma once

#include "rendering/renderer.h"

namespace palpate::bench {

/// The functions in which callgrind counts. In a file of its own, where the compiler cannot know
/// the renderer.
double measured_tick(const rendering::Renderer& renderer, const rendering::Scene& scene,
                     rendering::RenderState& state, const rendering::LineProbe& probe);

}  // namespace palpate::bench
