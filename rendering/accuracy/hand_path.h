#pragma once
// Ways of a hand over one shape, on which renderers are compared.

#include <cstdint>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/object_spec.h"

namespace palpate::rendering {

/// A path in the shape's frame, a pose a tick of 1 ms. The first `approach` poses come in from the
/// outside; then the probe is in contact with the analytic shape.
struct HandPath {
  std::vector<LineProbe> poses;
  std::size_t approach = 0;
};

struct HandPathSettings {
  std::uint64_t seed = 1;
  int contact_ticks = 1000;
  double length = 0.12;   ///< m, of the stylus; 0: a point
  double speed = 0.1;     ///< m/s, of the place that the hand strokes
  double shallow = 1e-3;  ///< m; least and
  double deep = 2e-3;     ///< m; most depth while in contact
};

/// A hand that strokes the analytic shape. The place it strokes wanders at the given speed: a
/// direction from the middle, at 30 mm, with a heading that turns at random (0.02 rad a tick,
/// standard deviation). The stylus is stroked at 0 to 40 mm from its tip (period 1.9 s), spins
/// about the direction (2.9 s a turn) and tilts by 0.8 rad to and fro (3.1 s), with phases by the
/// seed: so tip and side touch, at faces, edges and rims. It is pressed so that the exact least
/// depth runs between `shallow` and `deep` (period 0.7 s), to 1 nm. It comes in along the first
/// direction at the same speed from 3 mm outside. The same for every tessellation.
HandPath hand_path(const stimuli::ObjectSpec& primitive, const HandPathSettings& settings);

}  // namespace palpate::rendering
