#pragma once
// Local penetration depths in the analytic shapes with rims, cylinder and cone. Included by
// local_depths*.cpp alone.

#include "rendering/accuracy/local_depths_collector.h"

namespace palpate::rendering::depths {

/// Outward normal of the cone's side in the half plane of the horizontal unit vector `out`.
Vec3 cone_normal(const stimuli::ObjectSpec& cone, const Vec3& out);

void depths_in_cylinder(Collector& collector);
void depths_in_cone(Collector& collector);

}  // namespace palpate::rendering::depths
