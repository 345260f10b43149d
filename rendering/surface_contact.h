#pragma once
// The contact law for closed surfaces: any tool of straight segments against any closed, oriented
// surface, by one god-object, the ideal tool.
//
// For a fixed orientation of the tool, the translations at which it touches are made of patches: a
// triangle with an end of a segment, an edge that is not concave with a segment that sees its two
// triangles on either side. The ideal tool starts outside and goes through no patch from its outer
// side, so patches that are buried in the solid are never met. Each tick it turns as the virtual
// tool did, as far as its way, with the ends of the segments moving linearly, meets no patch; then
// it moves as near to the virtual tool as planes and straight casts allow.
//
// Zilles & Salisbury 1995 (god-object, active planes), Ortega, Redon & Coquillart 2007 (6-DoF
// god-object), Woop, Benthin & Wald 2013 (watertight casts). Departs: constraints are patches of
// translations, so no contact points are sampled.
//
// Nothing here throws, allocates, locks or does I/O.

#include <cstdint>

#include "rendering/union_contact.h"

namespace palpate::rendering {

/// Follows the ideal tool of one surface and appends its contacts, with spring forces, to
/// state.unions.contacts.
/// \param surface  index in Scene::surfaces()
void follow_on_surface(UnionTick& tick, std::uint32_t surface);

/// Whether the virtual tool is inside of the surface or goes through it.
bool inside_surface(UnionTick& tick, std::uint32_t surface);

}  // namespace palpate::rendering
