#pragma once
// The surface of an object as a page shows it: corners that triangles share.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stimuli/shapes.h"

namespace palpate::runner {

struct PictureMesh {
  std::vector<Vec3> corners;  ///< m, the object's own frame
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t all_triangles = 0;  ///< of the object; more than are here: it was made coarser
};

/// \param most  triangles; where there are more, corners that are near to each other become one,
/// for the picture alone. \throws MeshError, std::runtime_error where a file is no mesh
PictureMesh picture_mesh(const stimuli::ObjectSpec& object, std::size_t most);

}  // namespace palpate::runner
