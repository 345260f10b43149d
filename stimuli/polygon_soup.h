#pragma once
// The corners and polygons of a mesh, and the error of one that cannot be made. SI units.

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

struct MeshNames;

/// The input of a mesh: vertices, and faces as index loops, counter-clockwise seen from outside.
struct PolygonSoup {
  std::vector<Vec3> vertices;                     ///< m
  std::vector<std::vector<std::uint32_t>> faces;  ///< three or more corners each
  /// m; error of each coordinate (from the digits of a text file, or single precision). 0: double
  /// precision. Tolerances are never smaller.
  double coordinate_error = 0;
  /// Names of a file's groups of faces, and the group number of each face. Empty: no groups.
  std::vector<std::string> group_names = {};
  std::vector<std::uint32_t> group_of = {};
  /// Names of vertices and faces in the file, for messages. nullptr: numbered from 0.
  std::shared_ptr<const MeshNames> names = {};
};

/// Why a polygon soup is not a convex mesh: one message for each fault (the first few of each
/// kind).
class MeshError : public std::runtime_error {
 public:
  explicit MeshError(std::vector<std::string> faults);
  const std::vector<std::string>& faults() const { return faults_; }

 private:
  std::vector<std::string> faults_;
};

}  // namespace palpate::stimuli
