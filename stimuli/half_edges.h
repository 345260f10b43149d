#pragma once
// A polygon soup as a linked surface: welded corners, and for every side of a face its twin in the
// neighbouring face. The first step of building a ConvexMesh.

#include <cstdint>
#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_faults.h"

namespace palpate::stimuli {

/// Half-edge h runs from corner origin[h] to origin[next(h)], counter-clockwise round face[h].
struct HalfEdges {
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xffffffff;

  std::vector<Vec3> points;        ///< m, welded
  std::vector<Index> soup_vertex;  ///< the soup's number of each point
  std::vector<Index> soup_face;    ///< the soup's number of each face
  std::vector<Index> first;        ///< face f has the half-edges first[f] .. first[f + 1]
  std::vector<Index> origin, face, twin;
  std::vector<Index> corner;  ///< the soup's vertex that each half-edge runs from
  MeshNaming naming;
  double size = 0;   ///< m, diagonal of the bounding box
  double error = 0;  ///< m, of each coordinate

  Index face_count() const { return static_cast<Index>(soup_face.size()); }
  Index count() const { return static_cast<Index>(origin.size()); }
  Index next(Index h) const { return h + 1 == first[face[h] + 1] ? first[face[h]] : h + 1; }
  Index previous(Index h) const { return h == first[face[h]] ? first[face[h] + 1] - 1 : h - 1; }
  const Vec3& from(Index h) const { return points[origin[h]]; }
  const Vec3& to(Index h) const { return points[origin[next(h)]]; }

  std::string name_face(Index f) const;    ///< "face 3 at line 20 (vertices 1 2 5)"
  std::string name_vertex(Index v) const;  ///< "vertex 5 at line 12"
  std::string name_edge(Index h) const;    ///< "edge 4-5 of face 3 ..."
};

/// What messages call a face of a soup, linked or not.
std::string name_of_face(const PolygonSoup& soup, std::size_t face);

/// \throws MeshError where indices or coordinates are unusable: no faces, not finite, too large.
void check_numbers(const PolygonSoup& soup);

enum class Pieces { one, any };

/// Welds, drops faces that welding has collapsed (their two sides cancel, so the surface stays
/// closed) and links twins. Reports open edges, edges of three faces, faces turned against their
/// neighbours, separate pieces where one is expected. \throws MeshError at once where indices or
/// coordinates are unusable.
HalfEdges link_half_edges(const PolygonSoup& soup, MeshFaults& faults, Pieces pieces = Pieces::one);

}  // namespace palpate::stimuli
