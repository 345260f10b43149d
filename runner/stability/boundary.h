#pragma once
// Where a loop stops being stable: measured, and what the theory of passivity says.

#include <span>
#include <vector>

#include "runner/stability/closed_loop.h"

namespace palpate::runner {

/// A loop but for the stiffness and the physical damping that are looked for.
struct LoopCase {
  Situation situation = Situation::wall;
  protocols::RendererKind renderer = protocols::RendererKind::point;
  LoopSettings settings;       ///< damping is not used
  double virtual_damping = 0;  ///< N s/m, of the material
  /// Each end as heavy as makes sampling 60 times faster than its swing on the spring: the case of
  /// the theory, where the mass plays no part. Else settings.mass.
  bool heavy = false;
};

struct BoundaryPoint {
  double stiffness = 0;  ///< N/m
  double measured = 0;   ///< N s/m, the least damping of each end that is stable
  double theory = 0;     ///< N s/m, that is passive with any hand
  /// Friction holds each count of the resolution (K <= 2 f_c / Delta), so the theory applies.
  bool promised = true;

  /// The theory promised too much.
  bool unsafe() const { return promised && measured > 1.001 * theory; }
};

/// K (T/2 + t_d) + |B|. Colgate & Schenkel 1997.
double passive_damping(const LoopCase& loop, double stiffness);

BoundaryPoint boundary_at(const LoopCase& loop, double stiffness);

/// N/m, up to 10^7: the stiffest that is stable with this damping of each end, and less are.
double stiffest_stable(const LoopCase& loop, double damping);

}  // namespace palpate::runner
