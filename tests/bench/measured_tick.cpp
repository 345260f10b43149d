#include "tests/bench/measured_tick.h"

namespace palpate::bench {

double measured_tick(const Renderer& renderer, const Scene& scene, RenderState& state,
                     const LineProbe& probe) {
  return renderer.tick(scene, state, probe, 1e-3).force.x;
}

}  // namespace palpate::bench
