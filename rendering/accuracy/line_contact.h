#pragma once
// A rigid cylinder that lies on an elastic layer, which is bonded to a rigid base: plane strain,
// small strains, no friction. Not for the servo.
//
// Hertz's pressure over a strip of half-width a, a^2 = 4 P' R / (pi E*) (Johnson 1985, "Contact
// mechanics", 4.2), and what a layer of that thickness gives under it (Meijers 1968, "The contact
// problem of a rigid cylinder on an elastic layer", Appl. Sci. Res. 18): the indentation is that of
// the strip's middle against the base, so no logarithm is left to choose. The pressure is that on a
// half-space, so it holds for a up to a third of the thickness.

namespace palpate::rendering {

struct LineContact {
  double young = 20000;     ///< Pa
  double poisson = 0;       ///< below 0.5
  double radius = 0.04;     ///< m, of the cylinder
  double thickness = 0.06;  ///< m, of the layer
};

/// m, that the cylinder sinks where the strip has this half-width (m).
double line_depth(const LineContact& contact, double half_width);
/// N/m. \param depth  m, above 0
double line_force(const LineContact& contact, double depth);

}  // namespace palpate::rendering
