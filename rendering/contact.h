#pragma once
// Contacts between the probe and objects, their types, the wrench (force and torque) that they give
// to the hand, and its split on two devices. Pure functions. World frame, SI units.

#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/probe.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// The contact types of Ho, Basdogan & Srinivasan 2000, fig. 4: end of the probe on a polygon; side
/// of the probe on an edge; probe lying on a face.
enum class ContactType : std::uint8_t { none, point_polygon, segment_edge, segment_face };

const char* to_string(
    ContactType type);  ///< "none", "point-polygon", "segment-edge", "segment-face"

/// World frame. depth is the penetration depth along normal, > 0 inside: moving the virtual probe
/// by depth * normal just separates it from the object.
struct Contact {
  Vec3 point;        ///< m, on the ideal probe (god-object)
  Vec3 normal;       ///< unit, out of the object
  double depth = 0;  ///< m
  double along = 0;  ///< m, from the tip along the probe to the contact point
  ContactType type = ContactType::none;
};

/// A contact with all data that determine its force.
struct LoadedContact {
  Contact contact;
  double probe_fraction = 0;  ///< of the contact point on the probe: 0 at the tip to 1 at the tail
  double stiffness = 0;       ///< N/m, at the surface
  /// m, this contact's share of the ideal probe's displacement, along its normal (set by load)
  double normal_displacement = 0;
  double force = 0;        ///< N, along the normal, on the hand; never negative (set by load)
  Vec3 tangential_offset;  ///< m, of the ideal probe along the surface (set by apply_friction)
  Vec3 shift;              ///< m, from the virtual to the ideal probe, with tangential_offset
  int object = -1;         ///< index of the object in the scene
  std::uint32_t part = 0;  ///< index of the part in the scene
};

/// Sets the displacement and the spring force of each contact (Hooke).
template <std::size_t kCount>
void load(std::span<LoadedContact, kCount> contacts) {
  for (auto& c : contacts) {
    c.normal_displacement = c.contact.depth;
    c.force = c.stiffness * c.normal_displacement;
  }
}

/// The friction state of a contact between ticks.
struct FrictionState {
  Vec3 tangential_offset;   ///< m, of the ideal probe along the surface
  bool sliding = false;     ///< else it sticks
  bool in_contact = false;  ///< at the last tick
};

/// One tick of Coulomb friction as a spring along the surface, stretched by the tangential offset
/// of the ideal probe: the contact sticks while that spring is within the static friction cone
/// (static coefficient times normal force), else it slides with the dynamic coefficient. Zilles &
/// Salisbury 1995 (god-object), Harwin & Melder 2002 (friction cone). The offset is projected onto
/// the surface at each tick, which never adds energy.
/// \param c       loaded; its tangential_offset is set
/// \param motion  m, of the probe at the contact since the last tick
void apply_friction(LoadedContact& c, const stimuli::Material& material, const Vec3& motion,
                    FrictionState& friction);

/// Wrench of contacts on the hand, and its split on two devices at the ends of the stylus.
struct Loads {
  Vec3 force;    ///< N, on the hand
  Vec3 torque;   ///< N m, about the virtual tip: sum of (contact - tip) x force
  Vec3 device1;  ///< N, at the tip
  Vec3 device2;  ///< N, at the tail
};

/// The loads of one contact; device 1 is left at zero.
/// \tparam kAlone  the only contact: without friction its shift is then along the force
template <bool kSegment, bool kFriction, bool kAlone>
[[gnu::always_inline]] inline Loads loads_of(const LoadedContact& c, const LineProbe& probe) {
  Loads loads;
  loads.force = c.force * c.contact.normal;
  if constexpr (kFriction) loads.force += c.stiffness * c.tangential_offset;
  if constexpr (kSegment) {
    // The lever is probe_fraction d + shift. The fraction is known last, so compute the vector that
    // it scales first.
    loads.torque = c.probe_fraction * glm::cross(probe.tail - probe.tip, loads.force);
    if constexpr (kFriction || !kAlone) loads.torque += glm::cross(c.shift, loads.force);
    loads.device2 = c.probe_fraction * loads.force;
  }
  return loads;
}

/// Sums the loads: equations (1), (4) and (5) of Ho, Basdogan & Srinivasan 2000, with the lever
/// from the tip: F1 = (1 - L1/L) F, F2 = (L1/L) F, with L1/L the probe_fraction of the contact. A
/// probe of zero length is touched at fraction 0: device 1 takes the whole force.
/// \tparam kSegment   false: a point, which has no lever; torque and device 2 are left at zero
/// \tparam kFriction  false: no contact has a tangential offset
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
