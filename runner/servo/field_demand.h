#pragma once
// Demand of fields on a device, so that the sampled loop of hand, device and fields is passive.

#include <vector>

#include "stimuli/shapes.h"

namespace palpate::runner::servo {

/// Of an object's fields together, at one of its points.
struct FieldDemand {
  double stiffness = 0;  ///< N/m, of springs and channels
  double damping = 0;    ///< N s/m, of physical damping that viscous and curl fields need
  double noise = 0;      ///< N, of a step of the position by `resolution`
};

/// The damping that a sampled viscous field of B N s/m needs is B alpha / (2 - alpha), alpha = T /
/// (low_pass + T) (Colgate & Schenkel 1997, with the low pass); a curl field's is the largest power
/// that it puts into circles, by the square of their speed, or 0 where it is left to the hand
/// (destabilising).
/// \param rate  Hz. \param resolution  m
FieldDemand demand_of(const std::vector<stimuli::FieldSpec>& fields, double rate,
                      double resolution);

}  // namespace palpate::runner::servo
