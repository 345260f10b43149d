#pragma once
// First contact exactly as in Ho, Basdogan & Srinivasan 2000, to measure the contacts that this
// test misses. Not used by any renderer.

#include <cstdint>

#include "rendering/probe.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// Ho, Basdogan & Srinivasan 2000, appendix 7, to the letter: the straight path of a point crosses
/// the facet's polygon, from either side.
bool crosses_polygon(const stimuli::ConvexMesh& mesh, std::uint32_t facet, const Vec3& before,
                     const Vec3& after);

/// Appendix 8, to the letter: with D the vector of nearest distance from the edge to the probe (6),
/// the probe has crossed the edge between the ticks when (1) D before and D after point against
/// each other, (2) the nearest points are not ends of the edge, and (3, 4) not ends of the probe.
/// "For this method to be valid, the translation and rotation [...] should be very small."
bool crosses_edge(const stimuli::ConvexMesh& mesh, std::uint32_t edge,
                  const rendering::LineProbe& before, const rendering::LineProbe& after);

/// Section 4(a): either end crosses a polygon, or the probe crosses an edge. All are tried.
bool paper_first_contact(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& before,
                         const rendering::LineProbe& after);

/// First contacts found and missed at one speed of the hand.
struct FirstContactLoss {
  double speed = 0;      ///< m/s, of the leading point of the stylus
  double turning = 0;    ///< rad/s
  int entries = 0;       ///< trials in which the probe enters
  int paper_missed = 0;  ///< no crossing found in the tick of entry
  int paper_never = 0;   ///< those of them not found in any of the next 20 ticks in contact
  int paper_early = 0;   ///< a crossing reported in an earlier tick, without a touch
  int exact_missed = 0;  ///< by first_contact_segment, in the tick of entry
};

/// Straight motions at 1 kHz that bring a stylus of 0.12 m into the object from a random side, with
/// random directions of stylus and motion, turning at a random rate up to `turning`. The tick of
/// entry is found by brute force in steps of a hundredth of a tick (deeper than 1e-9 of the size at
/// the end of the tick or at one of the steps). Motions that miss the object are drawn again.
FirstContactLoss first_contact_loss(const stimuli::ConvexMesh& mesh, double speed, double turning,
                                    int entries, std::uint64_t seed);

}  // namespace palpate::runner::evidence
