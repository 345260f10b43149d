#pragma once
// A probe outside of an object and near it, tracked through one tick of motion from feature to
// neighbouring feature: continuous collision detection without a search. Mesh frame, SI units.

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/probe.h"
#include "rendering/separation.h"

namespace palpate::rendering {

/// How a tick of motion near an object ended.
struct Approach {
  enum class End : std::uint8_t { separated, entered, undecided };
  End end = End::undecided;
  ContactFeature feature;  ///< separated: its plane separates at the end; entered: through it
  SeparatingPlane plane;   ///< separated: valid, at the end of the motion
  double time = 0;         ///< entered: time of impact, as a fraction of the tick
};

/// Tracks the probe while both ends move linearly from `before` to `after`: the facet of M whose
/// plane separates it is kept until the probe crosses that plane; there it either enters through
/// the facet, or is past a side, and the facet of M past that side separates from then on. The
/// times of crossing only grow, and up to each the probe is proven to be outside: the entry found
/// is the first one, for any speed. Undecided (rounding, or a long path round the object): ask
/// first_contact.
/// \param start  a feature whose plane separates the probe at `before`
Approach approach_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                          const LineProbe& before, const LineProbe& after);

/// The same for the tip alone.
Approach approach_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                        const LineProbe& before, const LineProbe& after);

}  // namespace palpate::rendering
