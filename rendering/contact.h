#pragma once
// A contact between the probe and an object, and its types.

#include <cstdint>

#include "rendering/probe.h"

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

}  // namespace palpate::rendering
