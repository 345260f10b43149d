#pragma once
// The names of a mesh's vertices and faces in messages, as in its file.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/polygon_soup.h"
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

/// The list of faults of a mesh.
/// Collects the faults of a mesh: the first few of each kind in full, then a count.
class MeshFaults {
 public:
  static constexpr std::size_t kShown = 3;  ///< faults of one kind that are given in full

  /// `describe` makes the message; it is called only when the message will be shown.
  template <class Describe>
  void add(const char* kind, Describe describe) {
    Kind& entry = entry_of(kind);
    if (++entry.count <= kShown) entry.messages.push_back(std::string(kind) + ": " + describe());
  }

  bool empty() const { return kinds_.empty(); }
  std::vector<std::string> messages() const;
  void throw_if_any() const;  ///< \throws MeshError

 private:
  struct Kind {
    std::string name;
    std::size_t count = 0;
    std::vector<std::string> messages;
  };
  Kind& entry_of(const char* kind);

  std::vector<Kind> kinds_;
};

}  // namespace palpate::stimuli
