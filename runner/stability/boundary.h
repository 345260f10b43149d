#pragma once
// The stability boundary of a haptic loop: by simulation, and the passivity condition of theory.

#include <span>
#include <vector>

#include "runner/stability/closed_loop.h"

namespace palpate::runner {

/// A loop without the two quantities that span the boundary: stiffness and physical damping.
struct LoopCase {
  ContactCase contact_case = ContactCase::wall;
  protocols::RendererKind renderer = protocols::RendererKind::point;
  LoopSettings settings;       ///< its damping is ignored
  double virtual_damping = 0;  ///< N s/m, of the material
  /// Of a layer half as deep as the contact, as a share of the surface's stiffness; 0: none.
  double layer_share = 0;
  /// The mass of each end is chosen so that it oscillates 60 times more slowly than the sampling
  /// rate: the case of the theory, which is independent of the mass. Else settings.mass.
  bool heavy = false;
};

struct BoundaryPoint {
  double stiffness = 0;  ///< N/m
  double measured = 0;   ///< N s/m, smallest stable damping of each end; 0: stable without
  double theory = 0;     ///< N s/m, passive with any hand
  /// The theory applies: friction dissipates the effect of quantisation (K <= 2 f_c / Delta).
  bool promised = true;

  /// Unstable although the theory promises passivity.
  bool unsafe() const { return promised && measured > 1.001 * theory; }
};

/// K (T/2 + t_d) + |B|, with K and B as they are felt: of surface and layer together, and through
/// the lever of a reach, touched at the virtual tip. Colgate & Schenkel 1997.
double passive_damping(const LoopCase& loop, double stiffness);

/// Whether the loop comes to rest, as run_loop() says, with this stiffness, N/m, and damping of
/// each end, N s/m.
bool is_stable(const LoopCase& loop, double stiffness, double damping);

BoundaryPoint boundary_at(const LoopCase& loop, double stiffness);

/// Largest stiffness, N/m, up to 10^7, up to which all are stable with this damping of each end.
double stiffest_stable(const LoopCase& loop, double damping);

}  // namespace palpate::runner
