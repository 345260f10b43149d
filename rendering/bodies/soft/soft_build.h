#pragma once
// From the description of a soft object to what is rendered: its elements, which of them are held,
// and the rate of its steps. Not for the servo.

#include <memory>

#include "rendering/bodies/soft/soft_coupling.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// How a soft object is touched, beside what its own description says.
struct SoftTouch {
  double radius = 0.002;  ///< m, of the tool
  Vec3 gravity{0, 0, 0};  ///< m/s^2
  int object = 0;         ///< index in the scene
};

/// What a step of so many elements and entries of the factor takes, s: by counting, so that a rate
/// that depends on it is the same on every computer. Twice what it took where it was measured.
double step_cost(std::size_t hexahedra, std::size_t tetrahedra, std::size_t factor_entries);

/// Whether tools of any size and springs up to 3 kN/m come to rest on a body of that material which
/// is stepped at that rate (Hz): found by simulation, `palpate stability --soft`.
bool coupling_is_stable(const SoftMaterial& material, double rate);

/// With a resolution of 0, the highest up to 10 that can be stepped. Steps at the highest of 1000,
/// 500, 250, 125 and 62.5 Hz of which they take a quarter at most. \param spec  with `soft`. \param
/// pose  of its local frame in the world \throws stimuli::MeshError: a file's faults, an element
/// that is flat, more elements than can be stepped at 62.5 Hz, nothing near a fixed point, a size
/// of more than 2 m or less than 1 mm
std::shared_ptr<const SoftObject> build_soft_object(const stimuli::ObjectSpec& spec,
                                                    const Pose& pose, const SoftTouch& touch);

}  // namespace palpate::rendering
