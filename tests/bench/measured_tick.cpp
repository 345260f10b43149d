#include "tests/bench/measured_tick.h"

namespace palpate::bench {

double measured_tick(const rendering::Renderer& renderer, const rendering::Scene& scene,
                     rendering::RenderState& state, const rendering::LineProbe& probe) {
  return renderer.tick(scene, state, probe, 1e-3).force.x;
}

}  // namespace palpate::bench
