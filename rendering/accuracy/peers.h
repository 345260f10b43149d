#pragma once
// Other collision libraries (Bullet, FCL) on the renderer's question: penetration depth and
// direction of a segment in a convex mesh. For comparisons, not for the servo: they allocate, and
// they do not keep to a side. Optional: built where CMake finds them (PALPATE_PEERS).

#include <memory>
#include <span>

#include "rendering/probe.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A library's result. Mesh frame.
struct PeerContact {
  double depth = 0;  ///< m; negative: the distance between them; NaN: the library gave up
  Vec3 normal;       ///< unit, out of the mesh; undefined where the depth is NaN
  Vec3 point;        ///< m, on the mesh: where the probe, moved by depth * normal, touches it
};

/// One mesh in one library, with the library's state between queries. Every library gets its best
/// settings: double precision, no margins, coordinates scaled to an object of radius 1 (their
/// tolerances are absolute), a hull that climbs from near by instead of looking at every vertex,
/// the probe as an exact segment, and the last normal as the first guess.
class Peer {
 public:
  virtual ~Peer() = default;
  /// \param probe  mesh frame; tip == tail is a point
  virtual PeerContact contact(const LineProbe& probe) = 0;
};

/// The mesh must outlive the peer.
using MakePeer = std::unique_ptr<Peer> (*)(const stimuli::ConvexMesh& mesh);

struct PeerLibrary {
  const char* name;     ///< "bullet", "fcl"
  const char* version;  ///< "3.24"; empty when absent
  const char* method;   ///< what is asked of it
  MakePeer make;        ///< null when this build is without it
};

/// All that are known, those absent from this build included.
std::span<const PeerLibrary> peer_libraries();

}  // namespace palpate::rendering
