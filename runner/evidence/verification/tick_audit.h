#pragma once
// Errors of one tick of a renderer over a scene of one convex part, against the brute-force
// reference. For checks, not for the servo.

#include "rendering/probe.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::runner::evidence {

/// Errors of one tick, each 0 in a correct tick. Lengths in m.
struct TickAudit {
  double depth = 0;       ///< of the virtual probe by the reference; negative: outside
  double missed = 0;      ///< depth of a probe without contact
  double penetrates = 0;  ///< depth of the ideal probe
  double floats = 0;      ///< gap between the ideal probe and the object, in contact
  double shallow = 0;     ///< difference by which a contact is shallower than the reference
  /// Relative error of force, torque and the devices' forces against a spring at the contact. In
  /// free space N and N m.
  double force = 0;
  bool finite = true;  ///< all numbers of the rendering
  /// m, rounding at this size and distance; shorter errors of lengths do not count.
  double tolerance = 0;

  bool good() const {
    return finite && missed <= tolerance && penetrates <= tolerance && floats <= tolerance &&
           shallow <= tolerance && force <= 1e-9;
  }
};

/// \param rounding  fraction of the object's size that counts as rounding. The tolerance also
/// includes rounding due to the distance from the origin and the probe's length.
/// \pre the scene has one part with a plain spring
TickAudit audit_tick(const rendering::Scene& scene, const rendering::Renderer& renderer,
                     const rendering::LineProbe& probe, const rendering::Rendering& rendering,
                     double rounding = 1e-9);

/// The part of the probe that can touch, in the frame of the part's mesh: for the point renderer
/// the tip alone.
rendering::LineProbe felt_probe(const rendering::Scene& scene, const rendering::Renderer& renderer,
                                const rendering::LineProbe& probe);

/// Whether all numbers of a rendering are finite.
bool all_finite(const rendering::Rendering& r);

}  // namespace palpate::runner::evidence
