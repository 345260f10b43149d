#pragma once
// Errors of one tick of a renderer over a scene of one convex part, against the brute-force
// reference. For checks, not for the servo.

#include "rendering/renderer.h"

namespace palpate::rendering {

/// What can touch, in the frame of the part's mesh: for the point renderer the tip alone.
LineProbe felt_probe(const Scene& scene, const Renderer& renderer, const LineProbe& probe);

/// Errors of one tick, each 0 where all is right. Lengths in m.
struct TickAudit {
  double depth = 0;       ///< of the virtual probe by the reference; negative: outside
  double missed = 0;      ///< depth of a probe without contact
  double penetrates = 0;  ///< depth of the ideal probe
  double floats = 0;      ///< gap between the ideal probe and the object, in contact
  double shallow = 0;     ///< by how much a contact is shallower than the reference
  /// Relative; how far force, torque and the devices' forces are from those of a spring at the
  /// contact. In free space N and N m.
  double force = 0;
  bool finite = true;  ///< all numbers of the rendering
  /// m, what counts as rounding at this size and distance: errors of lengths up to it are none.
  double tolerance = 0;

  bool good() const {
    return finite && missed <= tolerance && penetrates <= tolerance && floats <= tolerance &&
           shallow <= tolerance && force <= 1e-9;
  }
};

/// \param rounding  fraction of the object's size that counts as rounding; what its distance from
/// the origin and the probe's length add is in the tolerance as well \pre  the scene has one part,
/// of a plain spring
TickAudit audit_tick(const Scene& scene, const Renderer& renderer, const LineProbe& probe,
                     const Rendering& rendering, double rounding = 1e-9);

}  // namespace palpate::rendering
