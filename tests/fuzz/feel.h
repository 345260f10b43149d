#pragma once

#include <cmath>
#include <cstdlib>

#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::testing {

/// Draws a stylus through the middle of the world and turns what it carries: whatever the objects
/// are, the forces are finite.
inline void feel(const rendering::Scene& scene, const rendering::Renderer& renderer) {
  rendering::RenderState state = scene.initial_state();
  for (int i = -8; i <= 8; ++i) {
    const Vec3 tip(0.004 * i, 0.001 * i, -0.003 * i);
    state.measured_side = i % 3 == 0 ? Vec3(0) : Vec3(1, 0.2 * i, 0);
    const rendering::Rendering r =
        renderer.tick(scene, state, {tip, tip + Vec3(0.01, 0.02, 0.1)}, 1e-3);
    for (const Vec3& v : {r.force, r.torque, r.device1, r.device2}) {
      if (!std::isfinite(v.x + v.y + v.z)) std::abort();
    }
  }
}

}  // namespace palpate::testing
