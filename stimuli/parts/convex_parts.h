#pragma once
// The convex parts of a primitive or of the groups of a mesh file.

#include <optional>
#include <string>
#include <vector>

#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::stimuli {

class ConvexMesh;

/// m^3
double volume_of(const ConvexMesh& mesh);

/// A group of a mesh file that is a solid of its own.
struct SolidGroup {
  std::string name;  ///< for messages: "group 'left'"
  PolygonSoup soup;  ///< its own vertices only
};

/// Limit on the closed groups of a file.
inline constexpr std::size_t kMostClosedGroups = 10000;

/// Each group that is closed by itself, then the faces of all others together. A closed group whose
/// faces are all turned is a void: it joins the smallest of the others that contain it. Empty where
/// no group is closed by itself or the soup has no two groups. \throws MeshError: more than
/// kMostClosedGroups
std::vector<SolidGroup> solid_groups(const PolygonSoup& soup);

/// The convex parts of a primitive or mesh file in its local frame: one of a convex shape, the very
/// mesh that ConvexMesh makes of it. Groups of a file that are closed by themselves are parts; they
/// may overlap.
/// \throws MeshError: a group, or a file without groups, is not convex or not a solid;
/// std::runtime_error for an unreadable file; std::invalid_argument for a compound.
std::vector<ConvexMesh> convex_parts(const ObjectSpec& spec);

/// The same for polygons.
std::vector<ConvexMesh> convex_parts(const PolygonSoup& soup);

/// The same; nullopt where something is not convex or not a solid.
std::optional<std::vector<ConvexMesh>> convex_as_it_is(const PolygonSoup& soup);

/// m^3; of the intersection of two parts in one frame. 0 for bodies that abut.
double common_volume(const ConvexMesh& a, const ConvexMesh& b);

/// One sentence for each two groups of a mesh file that overlap by more than a millionth of the
/// smaller one; of many the three largest, and how many more there are. Overlaps are allowed,
/// because an object is the union of its parts, but an author of parts that should abut wants to
/// know. \throws as convex_parts
std::vector<std::string> group_overlaps(const ObjectSpec& spec);

}  // namespace palpate::stimuli
