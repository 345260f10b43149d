#pragma once
// Marks on a textured surface in a picture: the crests of ridges as lines, and where a texture
// has no ridges, dots on its crests. The object's frame, m.

#include <array>
#include <cstdint>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/texture.h"
#include "stimuli/vec.h"

namespace palpate::runner::design {

struct SurfaceMarks {
  std::vector<std::array<Vec3, 2>> lines;
  std::vector<Vec3> dots;
  int every = 1;  ///< a line for every n-th ridge: more would be too many to see
};

/// \param corners, triangles  of the surface
SurfaceMarks surface_marks(const stimuli::ObjectSpec& object, const stimuli::Texture& texture,
                           const std::vector<Vec3>& corners,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace palpate::runner::design
