#pragma once
// A probe outside of an object and near it, followed through one tick of motion: the neighbourhood
// watch before the contact.

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/probe.h"
#include "rendering/separation.h"

namespace palpate::rendering {

/// How a tick of motion near an object ended. Mesh frame.
struct Approach {
  enum class End : std::uint8_t { separated, entered, undecided };
  End end = End::undecided;
  MinkowskiFacet facet;   ///< separated: the one whose plane separates at the end; entered: by it
  SeparatingPlane plane;  ///< separated: valid, at the end of the motion
  double time = 0;        ///< entered: fraction of the tick
};

/// Follows the probe while both ends move linearly from `before` to `after`: the facet of M whose
/// plane separates it is kept until the probe comes through that plane; there it either enters by
/// the facet, or is beyond a side, and the facet beyond that side separates from then on. The times
/// at which the probe comes through planes only grow, and up to each the probe is proven to be
/// outside: an entry is the first one, for any speed. Undecided (rounding, or a long way round the
/// object): ask first_contact.
/// \param start  a facet whose plane separates the probe at `before`
Approach approach_segment(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                          const LineProbe& before, const LineProbe& after);

/// The same for the tip alone.
Approach approach_point(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                        const LineProbe& before, const LineProbe& after);

}  // namespace palpate::rendering
