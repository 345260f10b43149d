#pragma once
// The extended probe (Ho, Basdogan & Srinivasan 2000, fig. 3b): a virtual stylus that is the real
// one stretched about a pivot, and the forces on the hand by virtual work. Pure. World frame, SI
// units.

#include <algorithm>
#include <glm/geometric.hpp>

#include "rendering/probe.h"
#include "rendering/renderer.h"

namespace palpate::rendering {

/// virtual end = pivot + factor (real end - pivot), for both ends.
struct Reach {
  double factor = 1;      ///< virtual length by real length, above 0
  bool in_world = false;  ///< the pivot stands still in the world; else it is carried by the stylus
  double fraction = 0;    ///< place of a pivot on the stylus: 0 at the tip, 1 at the tail
  Vec3 point{0, 0, 0};    ///< m, of a pivot in the world

  Vec3 pivot(const LineProbe& real) const {
    return in_world ? point : (1 - fraction) * real.tip + fraction * real.tail;
  }
};

/// Forces on the two ends of a stylus, N.
struct EndForces {
  Vec3 tip, tail;
};

inline LineProbe stretched(const Reach& reach, const LineProbe& real) {
  const Vec3 pivot = reach.pivot(real);
  return {pivot + reach.factor * (real.tip - pivot), pivot + reach.factor * (real.tail - pivot)};
}

/// The inverse of stretched: a pivot on the stylus is as far along the virtual one.
inline LineProbe unstretched(const Reach& reach, const LineProbe& virtual_probe) {
  const Vec3 pivot = reach.pivot(virtual_probe);
  return {pivot + (virtual_probe.tip - pivot) / reach.factor,
          pivot + (virtual_probe.tail - pivot) / reach.factor};
}

/// The forces on the ends of the real stylus for forces on the ends of the virtual one: they do the
/// same work for every motion of the real ends. The virtual ends are linear in the real ones,
///   v = factor r + (1 - factor) pivot,  pivot = (1 - fraction) r_tip + fraction r_tail, so these
///   are the forces through the transposed map. A pivot on the stylus keeps their sum; one in the
///   world multiplies it by the factor.
inline EndForces felt(const Reach& reach, const EndForces& on_virtual) {
  const Vec3 tip = reach.factor * on_virtual.tip, tail = reach.factor * on_virtual.tail;
  if (reach.in_world) return {tip, tail};
  const Vec3 on_pivot = (1 - reach.factor) * (on_virtual.tip + on_virtual.tail);
  return {tip + (1 - reach.fraction) * on_pivot, tail + reach.fraction * on_pivot};
}

/// The inverse of felt: the forces on the virtual ends that are felt as these.
inline EndForces on_virtual(const Reach& reach, const EndForces& felt_at_ends) {
  const Vec3 pivot =
      reach.in_world ? Vec3(0) : (1 - reach.factor) * (felt_at_ends.tip + felt_at_ends.tail);
  return {(felt_at_ends.tip - (1 - reach.fraction) * pivot) / reach.factor,
          (felt_at_ends.tail - reach.fraction * pivot) / reach.factor};
}

/// A rendering of the virtual stylus with force and device forces at the real ends. Torque stays
/// about the virtual tip, and all places stay on the virtual stylus.
inline Rendering felt(const Reach& reach, Rendering rendering) {
  const EndForces forces = felt(reach, EndForces{rendering.device1, rendering.device2});
  rendering.device1 = forces.tip;
  rendering.device2 = forces.tail;
  rendering.force = forces.tip + forces.tail;
  return rendering;
}

/// The factor by which a lever multiplies a contact's felt stiffness. It is the square of the
/// greatest motion of a contact at `along` (0 at the virtual tip, 1 at the virtual tail) for a unit
/// motion of the real ends (root of the sum of squares). 1 for a plain stylus touched at an end.
inline double stiffness_gain(const Reach& reach, double along) {
  const double pivot = reach.in_world ? 0 : 1 - reach.factor;
  const double tip = (1 - along) * reach.factor + pivot * (1 - reach.fraction);
  const double tail = along * reach.factor + pivot * reach.fraction;
  return tip * tip + tail * tail;
}

}  // namespace palpate::rendering
