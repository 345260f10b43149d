#pragma once
// A hand that strokes an analytic shape at a prescribed depth, the paths on which methods are
// compared, and a contact of lines with a known solution. Frame of the shape, SI units.

#include <cstdint>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/shapes.h"

namespace palpate::runner::evidence {

/// A rigid cylinder that lies on an elastic layer, which is bonded to a rigid base: plane strain,
/// small strains, no friction. Not for the servo.
///
/// Hertz's pressure over a strip of half-width a, a^2 = 4 P' R / (pi E*) (Johnson 1985, "Contact
/// mechanics", 4.2), and the deformation of a layer of that thickness under it (Meijers 1968, "The
/// contact problem of a rigid cylinder on an elastic layer", Appl. Sci. Res. 18). The indentation
/// is that of the strip's middle relative to the base, so no logarithmic constant is left to
/// choose. The pressure is that on a half-space, so the result holds for a up to a third of the
/// thickness.
struct LineContact {
  double young = 20000;     ///< Pa
  double poisson = 0;       ///< below 0.5
  double radius = 0.04;     ///< m, of the cylinder
  double thickness = 0.06;  ///< m, of the layer
};

/// m, indentation by the cylinder if the strip has this half-width (m).
double line_depth(const LineContact& contact, double half_width);
/// N/m.
/// \param depth  m, above 0
double line_force(const LineContact& contact, double depth);

/// A pose for each tick of 1 ms. In the first `approach` poses the probe approaches from outside;
/// from then on it is in contact with the analytic shape.
struct AnalyticStroke {
  std::vector<rendering::LineProbe> poses;
  std::size_t approach = 0;
};

struct AnalyticStrokeSettings {
  std::uint64_t seed = 1;
  int contact_ticks = 1000;
  double length = 0.12;   ///< m, of the stylus; 0: a point
  double speed = 0.1;     ///< m/s, of the point that the hand strokes
  double shallow = 1e-3;  ///< m; least and
  double deep = 2e-3;     ///< m; most depth while in contact
};

/// The stroked point wanders at the given speed, measured 30 mm from the middle; its heading turns
/// at random (0.02 rad a tick, standard deviation). It lies 0 to 40 mm from the stylus's tip
/// (period 1.9 s). The stylus spins about the direction from the middle (2.9 s a turn) and tilts by
/// 0.8 rad to and fro (3.1 s), with phases from the seed, so that tip and side touch faces, edges
/// and rims. It is pressed so that the exact least depth runs between `shallow` and `deep` (period
/// 0.7 s), to 1 nm. It approaches along the first direction at the same speed from 3 mm outside.
/// The same for every tessellation.
AnalyticStroke analytic_stroke(const stimuli::ObjectSpec& primitive,
                               const AnalyticStrokeSettings& settings);

}  // namespace palpate::runner::evidence
