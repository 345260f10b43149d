#pragma once

#include <cstdint>

#include "rendering/probe.h"

namespace palpate::rendering {

/// The contact types of Ho, Basdogan & Srinivasan 2000, fig. 4.
enum class ContactType : std::uint8_t { none, point_polygon, segment_edge, segment_face };

const char* to_string(
    ContactType type);  ///< "none", "point-polygon", "segment-edge", "segment-face"

/// World frame. normal: unit, out of the object. depth > 0 inside: moving the probe by
/// depth * normal just separates it from the object.
struct Contact {
  Vec3 point;  ///< m, on the ideal probe
  Vec3 normal;
  double depth = 0;  ///< m
  double along = 0;  ///< m, from the tip along the probe to the contact point
  ContactType type = ContactType::none;
};

}  // namespace palpate::rendering
