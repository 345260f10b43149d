#pragma once
// The contact with a textured surface. A texture is a height h <= 0 carved into the surface, so
// that contacts are found on the surface as it is, the envelope of the crests; then a god-object of
// its own, local to the facet of M that the probe touches (README.md), finds its place on the
// carved profile. With n the facet's normal and d the depth, it goes from its last place to the
// local minimum of 1/2 k |ideal - virtual|^2 over the in-plane displacement u of the ideal probe:
// F = k (u + (d + h(u)) n). Zilles & Salisbury 1995 (god-object). Departs: the constraint is a
// height, so the minimum is found by Newton's method. Nothing here throws or allocates.

#include <cstdint>
#include <glm/geometric.hpp>

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The place of the god-object on a texture between ticks.
struct TextureState {
  Vec3 place;             ///< m, where the probe touches the profile, projected onto the surface
  bool touching = false;  ///< at the last tick
};

/// A contact with the surface as it is. All in the texture's frame.
struct SmoothContact {
  Vec3 normal;       ///< unit, of the facet of M, out of the object
  double depth = 0;  ///< m, > 0: of the virtual probe along the normal
  Vec3 place;        ///< m, of the contact on the surface
  /// Along the object's edge that the probe's side touches; zero: the contact is on a face, and
  /// moves with the probe.
  Vec3 edge{0};
  Vec3 probe{0};   ///< m, from the probe's tip to its tail; beside an edge
  Vec3 window{0};  ///< m; the height is the mean over this length about the place
};

struct CarvedContact {
  bool touches = false;  ///< false: the virtual probe is above the profile
  Vec3 shift{0};         ///< m, from the virtual to the ideal probe; the force is along it
  bool lost = false;     ///< the search met its limit: the god-object stays at its last place
};

/// One tick of the god-object on the profile.
CarvedContact carve(const stimuli::Texture& texture, const SmoothContact& contact,
                    TextureState& state) noexcept;

struct UnionTick;
/// Carves the contacts of ideal tools (union_contact.h) in state.unions.contacts, each with its own
/// share of the depth, and drops those that are above their profile.
void carve_placed_contacts(UnionTick& tick);

}  // namespace palpate::rendering
