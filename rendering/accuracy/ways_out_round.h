#pragma once
// Internal to the ways out: those of the analytic shapes with rims, cylinder and cone.

#include "rendering/accuracy/ways_out_search.h"

namespace palpate::rendering::ways {

/// Outward normal of the cone's side in the half plane of the horizontal unit vector `out`.
Vec3 cone_normal(const stimuli::ObjectSpec& cone, const Vec3& out);

void out_of_cylinder(Search& s);
void out_of_cone(Search& s);

}  // namespace palpate::rendering::ways
