#pragma once
// Shared by the libraries' adaptors: mesh and probe in the libraries' units.

#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>

#include "runner/evidence/accuracy/peers.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/surfaces/support_map.h"

namespace palpate::runner::evidence::peers {

/// Mesh frame to coordinates in which the object has radius 1 about the origin.
struct Scale {
  explicit Scale(const stimuli::ConvexMesh& mesh) : centre(mesh.centre()), radius(mesh.radius()) {}
  Vec3 to_unit(const Vec3& p) const { return (p - centre) / radius; }
  Vec3 from_unit(const Vec3& p) const { return centre + radius * p; }

  Vec3 centre;
  double radius;
};

/// The mesh as a support function. Climbs from a start that depends on the direction alone, so that
/// a repeated query gives the same vertex, ties included: Bullet repeats queries for its witness
/// points.
class Hull {
 public:
  explicit Hull(const stimuli::ConvexMesh& mesh) : mesh_(mesh), scale_(mesh), map_(mesh, 0, 1) {}
  const Scale& scale() const { return scale_; }
  Vec3 support(const Vec3& direction) const {
    // Libraries may pass a zero direction.
    const Vec3 asked = glm::dot(direction, direction) > 0 ? direction : Vec3(1, 0, 0);
    const std::uint32_t vertex = stimuli::support_vertex(mesh_, asked, map_.near_support(asked));
    return scale_.to_unit(mesh_.vertices()[vertex]);
  }

 private:
  const stimuli::ConvexMesh& mesh_;
  Scale scale_;
  stimuli::SupportMap map_;
};

struct Segment {
  Vec3 tip, tail;
  Vec3 support(const Vec3& direction) const {
    return glm::dot(direction, tail - tip) > 0 ? tail : tip;
  }
};

std::unique_ptr<Peer> make_bullet(const stimuli::ConvexMesh& mesh);
std::unique_ptr<Peer> make_fcl(const stimuli::ConvexMesh& mesh);
std::unique_ptr<Peer> make_bullet_mesh(const PeerMesh& mesh);
std::unique_ptr<Peer> make_fcl_mesh(const PeerMesh& mesh);

constexpr double kThin = 1e-3;  ///< of the radius: of the capsule that stands for a segment

}  // namespace palpate::runner::evidence::peers
