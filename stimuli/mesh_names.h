#pragma once
// What messages call the vertices and faces of a mesh: what its file calls them.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// The numbers that a file gives its vertices and faces, and where they stand in it.
struct MeshNames {
  struct Name {
    std::uint32_t number;  ///< as the format counts
    std::uint32_t place;   ///< a line or byte, or a number in `places`
  };
  std::vector<Name> vertices;   ///< empty: they have no numbers, their coordinates tell them apart
  std::vector<Name> faces;      ///< empty: by the numbers of their corners alone
  std::string place_kind = {};  ///< "line", "byte"; empty where `places` says more
  std::vector<std::string> places = {};  ///< "/meshes/0/primitives/0"

  /// The same of some vertices and faces.
  MeshNames subset(const std::vector<std::uint32_t>& some_vertices,
                   const std::vector<std::uint32_t>& some_faces) const;
};

/// Names for the messages about one soup; without MeshNames it is numbered from 0.
class MeshNaming {
 public:
  MeshNaming() = default;
  explicit MeshNaming(std::shared_ptr<const MeshNames> names) : names_(std::move(names)) {}

  std::string label(std::uint32_t vertex, const Vec3& place) const;   ///< "5" or "(0.01, 0, 0.02)"
  std::string vertex(std::uint32_t vertex, const Vec3& place) const;  ///< "vertex 5 at line 12"
  /// "face 3 at line 20 (vertices 1 2 5)"; of many corners the first few.
  std::string face(std::uint32_t face, const std::vector<std::string>& corner_labels) const;

 private:
  std::string place_of(const MeshNames::Name& name) const;
  std::shared_ptr<const MeshNames> names_;
};

}  // namespace palpate::stimuli
