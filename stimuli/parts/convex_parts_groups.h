#pragma once
// The groups of a mesh file that are solids of their own.

#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

struct SolidGroup {
  std::string name;  ///< for messages: "group 'left'"
  PolygonSoup soup;  ///< its own vertices only
};

/// At most so many groups of a file may be closed.
inline constexpr std::size_t kMostClosedGroups = 10000;

/// Each group that is closed by itself, then the faces of all others together. A closed group whose
/// faces are all turned is a void: it goes with the least of the others that it lies in. Nothing
/// where no group is closed by itself or the soup has no two groups. \throws MeshError: more than
/// kMostClosedGroups
std::vector<SolidGroup> solid_groups(const PolygonSoup& soup);

}  // namespace palpate::stimuli
