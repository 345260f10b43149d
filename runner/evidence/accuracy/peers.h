#pragma once
// Other collision libraries (Bullet, FCL) for the renderer's task: penetration depth and direction
// of a segment in a convex mesh. For comparisons, not for the servo: they allocate and do not keep
// to a side. Optional: built if CMake finds them (PALPATE_PEERS).

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// A library's result. Mesh frame.
struct PeerContact {
  double depth = 0;  ///< m; negative: the distance between them; NaN: the library gave up
  Vec3 normal;       ///< unit, out of the mesh; undefined if the depth is NaN
  Vec3 point;        ///< m, on the mesh: where the probe, moved by depth * normal, touches it
};

/// One mesh in one library, with the library's state between queries. Every library gets its best
/// settings: double precision, no margins, coordinates scaled to an object of radius 1 (their
/// tolerances are absolute), a hull that climbs from nearby instead of scanning every vertex, the
/// probe as an exact segment, and the last normal as the first guess.
class Peer {
 public:
  virtual ~Peer() = default;
  /// \param probe  mesh frame; tip == tail is a point
  virtual PeerContact contact(const rendering::LineProbe& probe) = 0;
};

/// The mesh must outlive the peer.
using MakePeer = std::unique_ptr<Peer> (*)(const stimuli::ConvexMesh& mesh);

/// A closed mesh of triangles, outward, as these libraries hold concave ones: a surface without an
/// inside.
struct PeerMesh {
  std::vector<Vec3> vertices;  ///< m
  std::vector<std::array<std::uint32_t, 3>> triangles;
  Vec3 centre;        ///< m, of a sphere around it
  double radius = 0;  ///< m
};
/// The deepest contact of a thin capsule (a thousandth of the radius) with the triangles.
using MakeMeshPeer = std::unique_ptr<Peer> (*)(const PeerMesh& mesh);

struct PeerLibrary {
  const char* name;         ///< "bullet", "fcl"
  const char* version;      ///< "3.24"; empty when absent
  const char* method;       ///< the algorithm used
  MakePeer make;            ///< null if this build lacks it
  const char* mesh_method;  ///< the algorithm used on meshes of triangles
  MakeMeshPeer make_mesh;   ///< null if this build lacks it
};

/// All known libraries, including those absent from this build.
std::span<const PeerLibrary> peer_libraries();

}  // namespace palpate::runner::evidence
