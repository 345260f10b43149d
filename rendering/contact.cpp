#include "rendering/contact.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {

const char* to_string(ContactType type) {
  switch (type) {
    case ContactType::none:
      return "none";
    case ContactType::point_polygon:
      return "point-polygon";
    case ContactType::segment_edge:
      return "segment-edge";
    case ContactType::segment_face:
      return "segment-face";
  }
  return "none";
}

void apply_friction(LoadedContact& c, const stimuli::Material& material, const Vec3& motion,
                    FrictionState& friction) {
  const Vec3& n = c.contact.normal;
  Vec3 offset = friction.tangential_offset - motion;
  offset -= glm::dot(offset, n) * n;
  const double pull = c.stiffness * glm::length(offset);
  const double coefficient =
      (friction.sliding ? material.friction_dynamic : material.friction_static);
  friction.sliding = pull > coefficient * c.force;
  if (friction.sliding) offset *= material.friction_dynamic * c.force / pull;
  friction.tangential_offset = c.tangential_offset = offset;
  friction.in_contact = true;
}

}  // namespace palpate::rendering
