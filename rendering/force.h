#pragma once
// From contacts to what the hand and the devices get. Pure functions.

#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/contact.h"
#include "rendering/probe.h"
#include "stimuli/object_spec.h"

namespace palpate::rendering {

/// A contact in the world frame with what decides its force.
struct LoadedContact {
  Contact contact;
  double place = 0;        ///< of the contact point on the probe: 0 at the tip to 1 at the tail
  double stiffness = 0;    ///< N/m, at the surface
  double share = 0;        ///< m, of the ideal probe's translation along the normal (set by load)
  double force = 0;        ///< N, along the normal, on the hand; never negative (set by load)
  Vec3 lag;                ///< m, of the ideal probe along the surface (set by rub)
  Vec3 shift;              ///< m, from the virtual to the ideal probe at the contact, with lag
  int object = -1;         ///< parts of one compound share it
  std::uint32_t part = 0;  ///< index of the part in the scene
};

/// The share of each contact: a contact that is alone has its whole depth; contacts with parts of
/// one compound share the shortest translation that satisfies them all, so that a seam between two
/// parts neither doubles the force nor lets it drop. Contacts of one object stand side by side.
void share_depths(std::span<LoadedContact> contacts);

/// Sets the share and the force of each contact: k share.
template <std::size_t kCount>
void load(std::span<LoadedContact, kCount> contacts) {
  if constexpr (kCount == 1) {
    contacts[0].share = contacts[0].contact.depth;
  } else {
    share_depths(contacts);
  }
  for (auto& c : contacts) c.force = c.stiffness * c.share;
}

/// The force, N, of a material with layers at `share` m below its surface: the sum of each layer's
/// stiffness times the part of the way that lies in it.
double layered_force(const stimuli::Material& material, double share);

/// What a contact remembers for friction.
struct Grip {
  Vec3 lag;              ///< m, of the ideal probe along the surface, world frame
  bool sliding = false;  ///< else it sticks
  bool held = false;     ///< in contact at the last tick
};

/// One tick of Coulomb friction through the ideal probe's lag along the surface: it stays where it
/// is while the lag's spring asks for no more than the static coefficient times the normal force,
/// else it slides, held back by the dynamic one. Zilles & Salisbury 1995 (god-object), Harwin &
/// Melder 2002 (friction cone). The lag turns with the surface by projection, which never feeds it.
/// \param c       loaded; its lag is set
/// \param motion  m, of the probe at the contact since the last tick
void rub(LoadedContact& c, const stimuli::Material& material, const Vec3& motion, Grip& grip);

/// Force and moment of contacts, and their split on two devices at the ends of the stylus.
struct Loads {
  Vec3 force;    ///< N, on the hand
  Vec3 torque;   ///< N m, about the virtual tip: sum of (contact - tip) x force
  Vec3 device1;  ///< N, at the tip
  Vec3 device2;  ///< N, at the tail
};

/// What one contact gives; device 1 is left at zero.
/// \tparam kAlone  without a second contact: then the shift is along the force, unless it lags
template <bool kSegment, bool kFriction, bool kAlone>
[[gnu::always_inline]] inline Loads loads_of(const LoadedContact& c, const LineProbe& probe) {
  Loads loads;
  loads.force = c.force * c.contact.normal;
  if constexpr (kFriction) loads.force += c.stiffness * c.lag;
  if constexpr (kSegment) {
    // The lever is place d + shift. The place is known last of all: what it scales comes before.
    loads.torque = c.place * glm::cross(probe.tail - probe.tip, loads.force);
    if constexpr (kFriction || !kAlone) loads.torque += glm::cross(c.shift, loads.force);
    loads.device2 = c.place * loads.force;
  }
  return loads;
}

/// Adds up; equations (1), (4) and (5) of Ho, Basdogan & Srinivasan 2000, with the lever from the
/// tip: F1 = (1 - L1/L) F, F2 = (L1/L) F, L1/L the contact's place on the probe. A probe of zero
/// length is touched at place 0: device 1 takes all.
/// \tparam kSegment   false: a point, which has no lever; torque and device 2 are left at zero
/// \tparam kFriction  false: no contact lags
template <bool kSegment, bool kFriction, std::size_t kCount>
[[gnu::always_inline]] inline Loads sum_loads(std::span<const LoadedContact, kCount> contacts,
                                              const LineProbe& probe) {
  constexpr bool kAlone = kCount == 1;
  Loads loads = loads_of<kSegment, kFriction, kAlone>(contacts[0], probe);
  if constexpr (!kAlone) {
    for (const auto& c : contacts.subspan(1)) {
      const Loads more = loads_of<kSegment, kFriction, kAlone>(c, probe);
      loads.force += more.force;
      loads.torque += more.torque;
      loads.device2 += more.device2;
    }
  }
  loads.device1 = loads.force - loads.device2;
  return loads;
}

}  // namespace palpate::rendering
