#pragma once

#include "rendering/renderer.h"

namespace palpate::bench {

/// What callgrind counts in. In a file of its own, where the compiler cannot know the renderer.
double measured_tick(const Renderer& renderer, const Scene& scene, RenderState& state,
                     const LineProbe& probe);

}  // namespace palpate::bench
