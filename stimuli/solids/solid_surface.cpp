#include <algorithm>
#include <map>

#include "stimuli/solids/solid_mesh.h"

namespace palpate::stimuli {
namespace {

// Counter-clockwise from outside.
constexpr int kHexahedronFaces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                        {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
// Three corners, then the middles of the edges from each to the next.
constexpr int kTetrahedronFaces[4][6] = {
    {0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}};

/// Faces that one element alone has, in the order in which they were added.
template <std::size_t kNodes>
class OpenFaces {
 public:
  void add(const std::array<std::uint32_t, kNodes>& face) {
    std::array<std::uint32_t, kNodes> key = face;
    std::sort(key.begin(), key.end());
    const auto [found, is_new] = known_.try_emplace(key, faces_.size());
    if (is_new) {
      faces_.push_back({face, true});
    } else {
      faces_[found->second].open = false;
    }
  }
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const Face& face : faces_) {
      if (face.open) visit(face.nodes);
    }
  }

 private:
  struct Face {
    std::array<std::uint32_t, kNodes> nodes;
    bool open;
  };
  std::vector<Face> faces_;
  std::map<std::array<std::uint32_t, kNodes>, std::size_t> known_;
};

}  // namespace

std::vector<SurfaceTriangle> surface_of(const SolidMesh& mesh) {
  std::vector<SurfaceTriangle> surface;
  OpenFaces<4> squares;
  for (const Hexahedron& element : mesh.hexahedra) {
    for (const auto& f : kHexahedronFaces)
      squares.add({element[f[0]], element[f[1]], element[f[2]], element[f[3]]});
  }
  squares.for_each([&](const auto& f) {
    surface.push_back({f[0], f[1], f[2]});
    surface.push_back({f[0], f[2], f[3]});
  });
  OpenFaces<6> triangles;
  for (const QuadraticTetrahedron& element : mesh.tetrahedra) {
    for (const auto& f : kTetrahedronFaces)
      triangles.add({element[f[0]], element[f[1]], element[f[2]], element[f[3]], element[f[4]],
                     element[f[5]]});
  }
  triangles.for_each([&](const auto& f) {
    surface.push_back({f[0], f[3], f[5]});
    surface.push_back({f[3], f[1], f[4]});
    surface.push_back({f[5], f[4], f[2]});
    surface.push_back({f[3], f[4], f[5]});
  });
  return surface;
}

}  // namespace palpate::stimuli
