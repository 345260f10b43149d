#pragma once
// From the description of a soft object to its rendering: its elements, its fixed nodes, and the
// rate of its steps. Not for the servo.

#include <cstddef>
#include <memory>

#include "rendering/bodies/soft/soft_body.h"
#include "rendering/bodies/soft/soft_object.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// How a soft object is touched, beyond its own description.
struct SoftTouch {
  double radius = 0.002;  ///< m, of the tool
  Vec3 gravity{0, 0, 0};  ///< m/s^2
  int object = 0;         ///< index in the scene
};

/// s, cost of a step with so many elements and entries of the factor. Computed from counts, so that
/// the rate is the same on every computer. Twice the measured time.
double step_cost(std::size_t hexahedra, std::size_t tetrahedra, std::size_t factor_entries);

/// Whether tools of any size with springs up to 3 kN/m come to rest on a body of this material
/// stepped at this rate (Hz). Found by simulation: `palpate stability --soft`.
bool coupling_is_stable(const SoftMaterial& material, double rate);

/// With a resolution of 0, uses the highest up to 10 that can be stepped. The rate is the highest
/// of 1000, 500, 250, 125 and 62.5 Hz at which a step takes at most a quarter of the time.
/// \param spec  with `soft`
/// \param pose  of its local frame in the world
/// \throws stimuli::MeshError: a file's faults, an element that is flat, more elements than can be
/// stepped at 62.5 Hz, nothing near a fixed point, a size of more than 2 m or less than 1 mm
std::shared_ptr<const SoftObject> build_soft_object(const stimuli::ObjectSpec& spec,
                                                    const Pose& pose, const SoftTouch& touch);

}  // namespace palpate::rendering
